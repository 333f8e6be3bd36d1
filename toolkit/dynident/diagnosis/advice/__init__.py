"""Which experiment would show an effect, or tell effects apart."""
