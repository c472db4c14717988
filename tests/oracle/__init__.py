"""What commands print, recomputed from the dense reference."""
