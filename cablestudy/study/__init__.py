"""Results of scenes, computed when a column or command asks: columns, accuracy, reports, tables."""
