"""Wind: spectra, coherence, forces on cables and bodies, variances of what they move."""
