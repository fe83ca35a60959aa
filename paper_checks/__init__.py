"""Claims of [GMBN], each restated and checked: one module per section of the paper."""
