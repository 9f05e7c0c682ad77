"""The sidebar: a module for each feature, with its properties, operators, drawing in views and section of the panel."""
