"""Pictures, with plotly for pages and notebooks and with matplotlib for papers."""
