"""Reference solutions for the tests: independent of ``cablestudy``, slow, and accurate.

catenary_mp
    The elastic catenary, also with point loads, at 50 digits.
continuous_cable
    The linearised continuous cable about its catenary: frequencies, participation, dynamic end stiffness.
bars
    The chain of equal bars (the paper's model): exact statics, dense modes, condensed end stiffness.
taut_string
    Textbook formulas: string, Irvine, axial waves.

Conventions of all of them: SI units; end 1 at the origin, end 2 at (a, 0, b) with a > 0; s is the unstretched arc
length from end 1; z points up; the tension vector at s is the force that the part beyond s exerts on the part before s.

Parameters that all of them share: L unstretched length [m]; EA axial stiffness [N]; m mass [kg/m] and w weight [N/m],
both per unstretched length; g gravity [m/s^2]; omega angular frequency [rad/s]; loads: dead forces as (s, (fx, fy, fz))
[m], [N].
"""
