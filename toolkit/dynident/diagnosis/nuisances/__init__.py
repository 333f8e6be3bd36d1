"""What is no missing physics and is allowed for: contacts, friction width, quantisation."""
