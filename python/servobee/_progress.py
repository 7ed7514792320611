"""What is told the stages of a run."""


class Progress:
    """What is told the stages of a run: nothing, a bar of tqdm, or a function."""

    def __init__(self, progress, what):
        self.told = progress if callable(progress) else None
        self.bar = None
        if progress is True:
            from tqdm.auto import tqdm

            self.bar = tqdm(desc=what, unit=" steps")
            self.told = self._step

    def _step(self, stage):
        self.bar.set_postfix_str(stage)
        self.bar.update()

    def __enter__(self):
        return self.told

    def __exit__(self, *_):
        if self.bar is not None:
            self.bar.close()
