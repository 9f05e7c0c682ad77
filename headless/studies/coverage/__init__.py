"""Coverage study of a site: types × heights × numbers, vanilla against weighted, and the claims of the paper."""
