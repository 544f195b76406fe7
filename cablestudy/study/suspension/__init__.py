"""Results of suspensions: cases, columns, state spaces, reports."""
