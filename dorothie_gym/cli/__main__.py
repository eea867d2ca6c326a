"""`python -m dorothie_gym.cli`, for where the script is not on the path."""

from dorothie_gym.cli.app import main

main()
