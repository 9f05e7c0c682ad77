"""The paper's own case study, reproduced on its map: published figures and claims, and the page."""
