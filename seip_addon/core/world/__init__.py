"""From a map, an extract or an elevation model to the model of a street."""
