"""What the user interface remembers between frames, and what it asks of its host. No drawing here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum, auto
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.compare.options import ReferenceOptions
from app.errors import UserError
from app.options import Options, option
from app.session.edits import EditHistory
from app.session.keeping import Aside, Keeping
from app.ui.plots import Zooms
from app.util.recent import Recent

if TYPE_CHECKING:
    from app.atlas.options import AtlasOptions
    from app.scene.area_lamps import AreaLamp
    from app.session.baking import Baking, Order
    from app.session.picking import Picked
    from app.session.stats import Stats

RGB = tuple[float, float, float]
TOAST_SECONDS = 6.0
WATCH_SECONDS = 3.0  # of a solve, in which one sees shot after shot unless another pace was chosen


class Request(Enum):
    """What only the host (window or headless) can do."""

    QUIT = auto()
    SCREENSHOT = auto()
    SAVE_PICTURE = auto()
    RELOAD_SHADERS = auto()


@dataclass(frozen=True)
class Pace(Options):
    """How much is solved between two pictures."""

    pace: str = option(
        "auto",
        "watch: one step (a shot) between two pictures; fast: as many as there is time for; auto: watch for the first "
        f"{WATCH_SECONDS:g} seconds, then fast",
        choices=("auto", "watch", "fast"),
    )

    def is_fast(self, seconds: float) -> bool:
        """Whether it is, after so many seconds of solving."""
        return self.pace == "fast" or (self.pace == "auto" and seconds >= WATCH_SECONDS)


@dataclass(frozen=True)
class Leaving:
    """A wish for which what is open is left: the question that it may need, the word that says yes, and what is done then."""

    title: str
    word: str
    go: Callable[[], object]


@dataclass(frozen=True)
class PictureFile:
    """A picture of the view alone that is to be saved: where, and its width and height [px]."""

    path: Path
    size: tuple[int, int]


@dataclass
class Saving:
    """A picture that is drawn for a file: the file's name, and the share that is done. stopped: by the user."""

    name: str
    share: float = 0.0
    stopped: bool = False


@dataclass(frozen=True)
class Legend:
    """The false-colour scale: ``colours`` from ``minimum`` to ``maximum`` [unit]."""

    quantity: str
    unit: str
    minimum: float
    maximum: float
    logarithmic: bool
    colours: tuple[RGB, ...]


@dataclass
class Toast:
    """One line over the view, for a while."""

    text: str
    error: bool
    seconds: float = 0.0


@dataclass
class Flight:
    """The eye on its way to a focus: from one place and distance to another."""

    start: tuple[Any, float]  # eye (3,) [m], distance [m]
    end: tuple[Any, float]
    seconds: float = 0.0


@dataclass
class State:
    """Everything that belongs to the interface and not to the session.

    measured: whether numbers that depend on the machine's speed are shown (off for pictures that are compared). live: whether
    frames follow each other, so that there is a rate of them. texture_id: makes a texture of the host drawable; legend: the
    scale of what is shown now; stats: of the session, asked once per frame (None without a scene). atlas, adaptive: edited,
    not yet applied. view_px: the 3-D view (left, top, width, height) [display units]. inspected: what the solver showed last,
    and of which light. draw_rays: those of the picked texel, in the room. pointed: under the pointer, and where.
    reveal_material: the list scrolls to the selected one. draw_lights: handles of lamps, in the view; lights_shown: whether the
    Lights panel is. reference: of a solve in the background; layer: to go back to from the error. edits: of the open scene;
    held: whether a hand was at a control in the last frame. Looked up once of a scene: used, the materials that are somewhere;
    mean_factors, what multiplies their albedos on the mean; own_lamps, with area, as if they were copies of themselves; homes,
    where these are in the file, and whether they are part of a larger piece. typed_colours: asked for by hand, by what albedos
    were held at. version: of the open scene, that edits are noted of. held_lamp: one with area as a hand holds it, by its
    material; scale: a texel density, the same. keeping: saves and opens
    sessions; asides: what crashes have left, that is offered; recover: the one to be asked about; leaving: a wish that is to be
    answered; after_saving: what waits for a session to be saved. order: of the next bake, as far as it was edited; baking: the
    last. picture: that is to be saved; saving: the one that is drawn for it. text_size: over what the screen asks for.
    """

    measured: bool = True
    live: bool = True
    text_size: float = 1.0
    scenes: tuple[str, ...] = ()
    texture_id: Callable[[Any], int] | None = None
    legend: Legend | None = None
    stats: Stats | None = None
    pace: Pace = field(default_factory=Pace)
    show_ui: bool = True
    show_help: bool = False
    ask_for_file: bool = False
    ask_for_reference: bool = False
    ask_for_picture: bool = False
    picture: PictureFile | None = None
    saving: Saving | None = None
    leaving: Leaving | None = None
    ask_for_session_name: bool = False
    ask_for_settings: bool = False
    ask_for_settings_name: bool = False
    after_saving: Callable[[], object] | None = None
    keeping: Keeping = field(default_factory=Keeping)
    asides: list[Aside] = field(default_factory=list)
    recover: Aside | None = None
    recent: Recent = field(default_factory=Recent)
    edits: EditHistory = field(default_factory=EditHistory)
    held: bool = False
    hidden_panels: set[str] = field(default_factory=set)
    docked: set[str] = field(default_factory=set)
    rebuild_layout: bool = False
    view_px: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)
    ratio: float = 1.0
    fps: float = 0.0
    picked: Picked | None = None
    picked_age: float = 0.0
    pointed: Picked | None = None
    pointed_at: tuple[object, ...] | None = None
    pointed_age: float = 0.0
    reveal_material: bool = False
    draw_rays: bool = True
    inspected: tuple[object, object, Any] | None = None
    inspected_age: float = 0.0
    inset: tuple[object, Any] | None = None
    inset_age: float = 0.0
    drag_button: int = -1
    split_held: bool = False
    flying: bool = False
    compared: bool = False
    flight: Flight | None = None
    material: int = 0
    light: int = 0
    area_lamp: int = 0
    used: tuple[object, tuple[int, ...]] = (None, ())
    version: object = None
    light_held: bool = False
    held_lamp: tuple[int, AreaLamp] | None = None
    own_lamps: tuple[object, dict[int, AreaLamp]] = (None, {})
    homes: tuple[object, dict[int, tuple[RGB, bool]]] = (None, {})
    scale: tuple[int, float] | None = None
    area_held: bool = False
    draw_lights: bool = True
    lights_shown: bool = False
    atlas: AtlasOptions | None = None
    adaptive: bool | None = None
    emitting_area: tuple[object, float] = (None, 0.0)
    emission_colours: dict[int, RGB] = field(default_factory=dict)
    typed_colours: dict[RGB, RGB] = field(default_factory=dict)
    mean_factors: tuple[object, dict[int, RGB]] = (None, {})
    plot: str = "work"
    plot_alone: str = "remaining"
    zooms: Zooms = field(default_factory=Zooms)
    reference: ReferenceOptions = field(default_factory=ReferenceOptions)
    ask_for_folder: bool = False
    order: Order | None = None
    baking: Baking | None = None
    layer: str = "combined"
    toasts: list[Toast] = field(default_factory=list)
    last_message: str | None = None
    requests: list[Request] = field(default_factory=list)
    actions: list[Callable[[], object]] = field(default_factory=list)
    _known: tuple[object, object] = (None, None)

    def is_fast(self, seconds: float) -> bool:
        """Whether as much is solved as there is time for, after so many seconds of solving; a bake is not watched."""
        return self.pace.is_fast(seconds) or (self.baking is not None and self.baking.active)

    def act(self, action: Callable[[], object]) -> None:
        """Do this once the frame is built: what it raises cannot leave a window half drawn."""
        self.actions.append(action)

    def quit(self) -> None:
        """Ask the host to end, once the user agrees to lose what is not saved."""
        self.leaving = Leaving("Quit?", "Quit", lambda: self.requests.append(Request.QUIT))

    def leave_for(self, opening: Callable[[], object]) -> None:
        """Open something else, once the user agrees to lose what is not saved."""
        self.leaving = Leaving("Open another?", "Open", opening)

    def run_actions(self) -> None:
        """Do what was asked for; a user's mistake becomes a toast."""
        actions, self.actions = self.actions, []
        for action in actions:
            try:
                action()
            except UserError as error:
                self.notify(str(error), error=True)

    def notify(self, text: str, *, error: bool = False) -> None:
        """Show one line over the view for a few seconds; a repeated one starts again."""
        self.toasts = [t for t in self.toasts if t.text != text][-3:]
        self.toasts.append(Toast(text, error))

    def remember(self, scene: object, lightmap: object) -> None:
        """What is open now, told every frame: nothing of another scene stays picked or selected, nor of another cut of it.
        Two scenes may have the same name, so that only which objects they are tells them apart."""
        if lightmap is not self._known[1]:
            self.picked = self.pointed = self.atlas = self.adaptive = None
        if scene is not self._known[0]:
            self.flight, self.material, self.light, self.area_lamp = None, 0, 0, 0
            self.scale = self.held_lamp = None
            self.area_held = False
            self.order = None
            self.emission_colours.clear()
            self.edits = EditHistory()
        self._known = scene, lightmap
