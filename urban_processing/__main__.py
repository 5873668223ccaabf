"""``python -m urban_processing`` is the command ``urban-processing``."""

from urban_processing.cli import main

if __name__ == "__main__":
    main()
