"""From rig to flight: zeros and gains on the aircraft, the band's budget, an aircraft's folder from its records."""
