"""From rig to flight: zeros and gains on the aircraft, an aircraft's folder from its records."""
