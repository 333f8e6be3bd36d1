"""dynident: robot model identification that tells you what physics your model lacks."""
