"""From a map, an extract, a city model or an elevation model to the model of a street."""
