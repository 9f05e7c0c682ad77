"""City models in CityJSON: buildings as solids that stand at a place of a map."""
