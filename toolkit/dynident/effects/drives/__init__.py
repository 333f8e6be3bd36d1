"""What drives do to the torque: gains, delays, offsets, ripple, rotors, shared transmissions."""
