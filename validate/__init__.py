"""From a simulated surface and caliper readings to a comparison, a verdict and a report."""
