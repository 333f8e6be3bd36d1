"""Laws proposed for what the catalogue leaves: a library of terms, the best of them confirmed."""
