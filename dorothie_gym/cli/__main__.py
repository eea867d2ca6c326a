"""`python -m dorothie_gym.cli`, for systems without the script on their path."""

from dorothie_gym.cli.app import main

main()
