"""From a top-down photo and a depth to a crack solid and a nozzle trajectory."""
