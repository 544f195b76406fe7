"""Suspensions at rest: where bodies and free points come to, unstretched lengths, tangent stiffness, stability."""
