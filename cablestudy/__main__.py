"""`python -m cablestudy` is the command `cablestudy`."""

from cablestudy.cli import main

if __name__ == "__main__":
    main(prog_name="cablestudy")
