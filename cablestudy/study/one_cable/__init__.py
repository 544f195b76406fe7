"""Results of one cable between two ends: cases, closed forms, elements, rows, reports."""
