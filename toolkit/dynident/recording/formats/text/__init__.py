"""Tables of text: their pieces, their head, comments, and the rows of numbers."""
