"""Winch loops: control law, loop gain, margins, responses in time, state space and its export."""
