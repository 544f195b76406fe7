"""What the paper prints, typed in, where several tests need it."""

# Table 2, and the finite-element column of Table 3: mode, type, symmetry, frequency [Hz], participation
TABLE_2 = """
 1  out-of-plane  symmetric      1.59  0
 2  in-plane      symmetric      1.59  5.63
 3  in-plane      antisymmetric  3.18  0.4
 4  out-of-plane  antisymmetric  3.18  0
 5  out-of-plane  symmetric      4.76  0
 6  in-plane      symmetric      4.76  1.52
 7  in-plane      antisymmetric  6.34  0.83
 8  out-of-plane  antisymmetric  6.34  0
 9  out-of-plane  symmetric      7.90  0
10  in-plane      symmetric      7.90  0.49
13  in-plane      symmetric      11.0  0.09
17  in-plane      symmetric      14.0  0.51
25  axial         symmetric      18.9  5380
62  axial         antisymmetric  37.8  10700
81  axial         symmetric      56.7  16000
82  axial         antisymmetric  75.4  21200
83  axial         symmetric      94.1  26200
"""
