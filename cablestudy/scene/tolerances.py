"""Numbers that bound what a user may write, and how it is read, in `scene`, each with its reason."""


class SceneTolerances:
    """Bounds of scenes and studies: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

    # ---------------------------------------------------------------------------------------------- files

    file_bytes: int = 10_000_000  # of a file, which is read as a whole
    base_files: int = 32  # upon each other
    fifo_wait: float = 2.0  # for a program that writes to a FIFO [s]
    nesting: int = 50  # levels of a file or a condition, which are read by recursion; names of a dotted key
    aliased_values: int = 100_000  # that aliases repeat: a short file could stand for more than the memory holds
    number_characters: int = 400  # of a number: the largest double has 309 digits
    quantity_characters: int = 80  # of a number with its unit; a longer text is none
    line_width: int = 120  # characters of a line of YAML that is written
    listed_mistakes: int = 100  # of a file
    listed_names: int = 8  # in a message

    # ------------------------------------------------------------------------ ranges of lengths and loads

    # gains, delays, damping and decays are zero or above: quotients of smaller numbers overflow
    least_positive: float = 1e-30
    # of the distance of the ends of a cable [m], and of products of keys, beyond any cable by many powers of ten:
    # their squares, and those of frequencies, stay finite
    chord_range: tuple = (1e-9, 1e9)
    stiffness_range: tuple = (1e-12, 1e24)  # of elastic modulus times area, as above [N]
    mass_range: tuple = (1e-18, 1e12)  # of density times area, as above [kg/m]
    prestrain_range: tuple = (1e-18, 10.0)  # of tension over axial stiffness, within what the solvers can hold [-]
    length_ratio: tuple = (0.2, 200.0)  # of the unstretched length to the distance of the ends,
    likely_length_ratio: tuple = (0.5, 5.0)  # and what of it is likely when a unit was mistaken
    point_loads: int = 1000  # on a cable
    # of a tensor of inertia that is written with few digits, relative to its trace
    inertia_rounding: float = 1e-9

    # ------------------------------------------------------------------------- curves and cross-sections

    curve_strain: float = 0.5  # to which stress-strain curves are measured [%],
    curve_steps: int = 50  # steps up to it at which their slope is looked at,
    least_curve_strain: float = 0.2  # and to which they must rise at least [%]
    flat_curve: float = 0.05  # slope over that at zero strain: a curve that gets flatter goes on along its tangent
    # modulus at zero strain over the final one, both over the whole area: beyond, something is in another unit
    likely_start: tuple = (0.25, 4.0)
    # area over that of the circle of the diameter, where both are written with two or three digits
    rounded_area: float = 1.02

    # ------------------------------------------------------------------------------------ likely mistakes

    similar_word: float = 0.6  # likeness of a misspelt word to the right one by difflib, at least,
    # and of so many letters one is wrong at most, or two in all: `direction` is no `duration`, which has three others
    letters_to_one_wrong: int = 5
    shortest_part: int = 3  # letters of a part of a name that two names may have in common

    # of a number without a unit for the diameter of a cable, or the thickness of ice: 1,85 mm is 1 and 85 mm [m]
    unlikely_thickness: float = 1.0
    coldest: float = 200.0  # likely temperature: a lower number without a unit is in degrees Celsius [K]
    strongest_turbulence: float = 1.0  # likely intensity: a larger number without a unit is in percent [-]
    unlikely_utilisation: float = 2.0  # of a limit without a unit, which hardly is 200 %
    equal_sizes: float = 0.01  # relative difference of diameters, or of areas, that are one
    thickest_wire: float = 5e-3  # diameter above which a cable is likely to be a rope, not solid [m]
    searched_cases: int = 20  # cases of a study that are searched for likely mistakes,
    listed_likely_mistakes: int = 3  # of which so many are listed

    # -------------------------------------------------------------------------------------------- studies

    cases: int = 10_000_000  # of a study, and values of a range: a sweep keeps a byte for each
    # cases up to which each is checked before anything is computed; of more each step with the first of the others
    checked_cases: int = 1000
    checked_steps: int = 50  # of a range or a sample: where the ends of a range are allowed, all between them are
    kept_scenes: int = 20  # of the first cases read, which several checks ask for
    sampled_numbers: int = 50_000_000  # drawn at once: 400 MB
    sensitivity_points: int = 8  # of a sensitivity study at least: below, bootstrap intervals are meaningless
    range_digits: int = 15  # of a value in a logarithmic range: what rounding leaves of powers, so that 2 stays 2


SCENE = SceneTolerances()
