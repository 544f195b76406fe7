"""Reports: a scene or a study as one page of HTML, with its tables, pictures, errors and provenance."""
