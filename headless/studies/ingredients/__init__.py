"""What each ingredient of a training for unseen sites gains: variants, sites to learn from, tests, table and chart."""
