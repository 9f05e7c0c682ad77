"""Output of the program: records, tables, pictures, reports and datasets."""
