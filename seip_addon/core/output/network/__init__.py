"""Results of a network of sites: record, map, table, chart and report."""
