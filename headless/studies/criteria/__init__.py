"""Does coverage foretell what a detector finds? Placements of one type and number, drawn over the range of coverage.

`drawing` draws them, `precision` evaluates one detector with each, `criteria` says how good each is by coverage and by
what stands beside it, `agreement` how well these agree with average precision, and `results` writes it down.
"""
