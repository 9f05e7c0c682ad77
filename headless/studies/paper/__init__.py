"""The paper's own case study, reproduced: published figures and claims, traffic with its demand, and the page."""
