"""The judge of recordings: what is wrong, where, and what would be right.

Static trials, explorations and what the cameras send live are judged by the same rules.
`trace_findings` looks at single markers, `static` at a static trial and what its fit
assumes, `repair` at exchanged names, `exploration` at a recording of a known person:
distances within segments (`distances`, `steps`, `axes`, `lags`), and segments on the
body (`tracking`, `slips`, `offsets`).
"""
