"""Fast model of the fill: the flow of paste along a crack, averaged over sections."""
