"""The paper's own case study beside this program's: its figures and claims, traffic after its demand, and the page."""
