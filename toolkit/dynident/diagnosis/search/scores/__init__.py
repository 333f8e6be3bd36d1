"""What an effect would bring: its columns beside the model's, as tests and penalties."""
