"""Zero-phase low-passes: the filters as second-order sections, and both passes of them at once."""
