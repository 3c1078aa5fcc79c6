"""Models, sensors, and the checks that every argument goes through."""
