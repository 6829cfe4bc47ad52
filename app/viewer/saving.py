"""Pictures that are saved from the window: of the view, drawn a part in each frame and then written in a thread, so that the
window goes on; and of the window itself, as it is."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from app.errors import UserError
from app.gpu import Framebuffer
from app.session.view import View
from app.ui.state import PictureFile, Saving, State
from app.util.background import BackgroundTask
from app.viewer.picture import check_suffix, is_linear, parts_of_picture, write_picture
from app.viewer.ui_frame import pixels

SCREENSHOT = "glowtree-{:04d}.png"


class Pictures:
    """Saves pictures of one view, one at a time, and tells the interface's state. ``step`` is called once per frame; whoever
    makes it ends it."""

    def __init__(self, view: View, state: State) -> None:
        self._view, self._state = view, state
        self._drawing: _Drawing | None = None
        self._writing: tuple[Path, BackgroundTask[None]] | None = None

    def begin(self, file: PictureFile) -> None:
        """Begin with one, unless another is being drawn."""
        if self._drawing is not None:
            return
        try:
            check_suffix(file.path)
            self._drawing = _Drawing(self._view, file)
        except UserError as error:
            self._state.notify(str(error), error=True)
        else:
            self._state.saving = Saving(file.path.name)

    @property
    def drawing(self) -> bool:
        """Whether a picture is being drawn: the scene has to stay as it is."""
        return self._drawing is not None

    @property
    def busy(self) -> bool:
        """Whether there is something to do."""
        return self.drawing or self._writing is not None

    def step(self) -> None:
        """Draw the next part, and say what was written."""
        if self._writing is not None and self._writing[1].ended:
            self._say_written()
        if self._drawing is not None and self._writing is None:
            self._draw(self._drawing)

    def _draw(self, drawing: _Drawing) -> None:
        said = self._state.saving
        assert said is not None
        self._view.session.run.hold()
        try:
            if not said.stopped:
                said.share = next(drawing.parts)
                return
        except StopIteration as end:
            path, image = drawing.path, end.value
            self._writing = path, BackgroundTask(str(path), lambda tell: write_picture(path, image))
        except UserError as error:
            self._state.notify(str(error), error=True)
        self._drop()

    def _drop(self) -> None:
        if self._drawing is not None:
            self._drawing.release()
        self._drawing = self._state.saving = None

    def _say_written(self) -> None:
        assert self._writing is not None
        (path, task), self._writing = self._writing, None
        try:
            _ = task.result
        except UserError as error:
            self._state.notify(str(error), error=True)
        else:
            self._state.notify(f"saved {path}")

    def end(self) -> None:
        """Draw no further; what is being written is waited for."""
        self._drop()
        if self._writing is not None:
            self._say_written()


class _Drawing:
    """A picture of a view's twin, which draws beside it. Whoever makes it releases it."""

    def __init__(self, view: View, file: PictureFile) -> None:
        self.path = file.path
        self._twin = view.twin(linear=is_linear(file.path))
        self.parts = parts_of_picture(self._twin, file.size)

    def release(self) -> None:
        self.parts.close()
        self._twin.release()


def save_screenshot(target: Framebuffer, size: tuple[int, int], folder: Path, state: State) -> None:
    """Write what ``target`` shows, of ``size`` (width, height) [px], into ``folder`` under the next free number, and say where it
    went or why not."""
    number = 1
    while (path := folder / SCREENSHOT.format(number)).exists():
        number += 1
    try:
        Image.fromarray(pixels(target, size)).save(path)
    except OSError as error:
        state.notify(f"{path}: cannot be written: {error.strerror or error}", error=True)
    else:
        state.notify(f"saved {path}")


__all__ = ["Pictures", "save_screenshot"]
