"""`python -m dorothie_gym`: the command line, for systems without the script on their path."""

from dorothie_gym.cli.app import main

if __name__ == "__main__":
    main()
