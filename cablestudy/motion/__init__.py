"""Motion of suspensions in the wind and under control: linear models with as many modes as their numbers need."""
