"""``python -m loopgate``: the `loopgate` command, where no script is on the path."""

from loopgate.cli.main import main

if __name__ == "__main__":
    main()
