"""Writes the scene of a flat square net to standard output: python net.py 30 > net-30x30.yaml."""

import sys

HEAD = """\
# A flat square net of n x n nodes of 1 kg, n = {n}, 1 m apart, without gravity; each cable is drawn to T = 100 N. Its
# frequencies out of the plane are 1/(2 pi) sqrt(4 T/(m a) (sin^2(p pi/(2 (n + 1))) + sin^2(q pi/(2 (n + 1))))) with
# m = 1 kg, a = 1 m, p and q from 1 to n. Written by net.py.
gravity: 0
cable:
  elastic_modulus: 100e9              # Pa; with the area EA = 1e6 N, so that 1 m / 1.0001 is drawn to 1 m by 100 N
  area: 10e-6
  density: 1e-6                       # next to nothing
  unstretched_length: {length!r}
  force_density: 100                  # N/m: the same form by the linear method
"""


def main(n):
    """Nodes n<row>-<column> at rows and columns 1 to n; 0 and n + 1 are fixed edges."""
    write = sys.stdout.write
    write(HEAD.format(n=n, length=1 / 1.0001))
    write("points:\n")
    inside = range(1, n + 1)
    for row in range(n + 2):
        for column in range(n + 2):
            if row in inside and column in inside:
                write(f"  n{row}-{column}: {{at: [{column}, {row}, 0], free: true, mass: 1}}\n")
            elif row in inside or column in inside:
                write(f"  e{row}-{column}: [{column}, {row}, 0]\n")
    write("cables:\n")

    def name(row, column):
        return f"{'n' if row in inside and column in inside else 'e'}{row}-{column}"

    for line in inside:
        for place in range(n + 1):
            write(f"  x{line}-{place}: {{from: {name(line, place)}, to: {name(line, place + 1)}}}\n")
            write(f"  y{line}-{place}: {{from: {name(place, line)}, to: {name(place + 1, line)}}}\n")


main(int(sys.argv[1]))
