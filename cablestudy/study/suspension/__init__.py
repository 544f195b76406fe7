"""Results of suspensions, and of one cable in loop and wind: cases, columns, linear models, reports."""
