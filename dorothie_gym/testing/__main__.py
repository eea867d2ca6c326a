"""`python -m dorothie_gym.testing`: checks the installation."""

from dorothie_gym.testing.installation import main

if __name__ == "__main__":
    main()
