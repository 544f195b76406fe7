"""`python -m cablestudy.cli`"""

from cablestudy.cli import main

if __name__ == "__main__":
    main()
