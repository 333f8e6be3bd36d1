"""What is other about the bodies: payload, zeros, base, springs, contacts."""
