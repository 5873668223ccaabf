"""Whatever is done in a session, in whatever order: nothing is ever half done or lost."""

from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path

import numpy as np
import shapely
import shapely.ops
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    precondition,
    rule,
)
from lands import LANDS, holed, site_of, star
from session_checks import (
    Seen,
    assert_far_stay,
    assert_given_streets_stay,
    assert_locked_stay,
    assert_numbers_stay,
    assert_requirements,
    assert_same,
    assert_whole,
    fingerprint,
)
from shapely.affinity import translate
from steered import tried

from urban_processing.errors import EditError
from urban_processing.io.boundaries import read_boundary
from urban_processing.io.files import read_layout, write_layout
from urban_processing.layout import Layout
from urban_processing.mesh.planar import PlanarMesh
from urban_processing.metrics import certificate
from urban_processing.params import CogenerateParams
from urban_processing.pipelines.levels import begin
from urban_processing.session.session import Session
from urban_processing.site import Site

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data" / "planken.gpkg"

SITES: dict[str, Site] = {
    "square": site_of(LANDS["square"]),
    "ell": site_of(LANDS["ell"]),
    "star": site_of(star(3)),
    "lakes": site_of(holed(4, 2)),
    "ellipse": site_of(LANDS["ellipse"], rim_is_street=False),
    "parts": site_of(shapely.box(0, 0, 300, 200), translate(star(7, 9, 160), 600, 100)),
}
if SAMPLE.exists():
    SITES["planken"] = read_boundary(SAMPLE)

PARCELS = 24
"""Parcels of a layout when it is finished, about."""

share = st.floats(0.0, 1.0, allow_subnormal=False, width=32)
pick = st.integers(0, 1000)


class SessionMachine(RuleBasedStateMachine):
    """A planner who does anything, in any order."""

    @initialize(
        land=st.sampled_from(sorted(SITES)),
        pattern=st.sampled_from(["loop", "tree"]),
        by_number=st.booleans(),
        levels=st.integers(0, 4),
    )
    def start(self, land: str, pattern: str, by_number: bool, levels: int) -> None:
        """Begin with some land, some levels later."""
        self.site = SITES[land]
        area = sum(part.area for part in self.site.parts)
        size = {"parcels": PARCELS} if by_number else {"min_area": area / PARCELS / 1.4}
        self.params = CogenerateParams(pattern=pattern, **size)
        self.session = Session.begin(self.site, self.params)
        # simplified once, at the beginning
        whole = begin(self.site, self.params).layout.mesh.face_polygons()
        self.land = shapely.coverage_union_all(whole)
        self.begun_with: Site | Layout = self.site
        self.seen = Seen.of(self.session)
        self.print = fingerprint(self.session)
        self.prints = {0: self.print}
        for _ in range(levels):
            self.do("step")

    # what is done, and what must hold after it

    def do(self, name: str, **values: object) -> None:
        """Do an edit; where it is refused, nothing has changed."""
        if self.session.is_complete and name in ("step", "finish"):
            return
        before, now = self.seen, len(self.session.edits)
        change = tried(lambda: self.session.do(name, **values))
        if isinstance(change, EditError):
            assert all(problem.endswith(".") for problem in change.problems), change.problems
            assert fingerprint(self.session) == self.print
            assert len(self.session.edits) == now
            return
        assert change.sentence.endswith(".")
        assert len(self.session.edits) == now + 1
        after = self.look()
        assert set(change.new) == set(after.parcels) - set(before.parcels)
        assert set(change.gone) == set(before.parcels) - set(after.parcels)
        assert_requirements(before, after, is_level=name == "step")
        assert_numbers_stay(before, after)
        if name in ("choose", "cut", "undo_cut", "merge"):
            assert_far_stay(before, after)
        if name not in ("unlock", "adopt", "merge"):
            assert_locked_stay(before, after)
        if name not in ("remove_street", "adopt"):
            assert_given_streets_stay(before, after)

    def look(self) -> Seen:
        """See what there is now, and whether it is sound."""
        self.seen = Seen.of(self.session)
        self.print = fingerprint(self.session)
        now = self.session._timeline.now
        assert self.prints.setdefault(now, self.print) == self.print
        assert_whole(self.seen, self.land)
        return self.seen

    def parcel(self, k: int) -> int:
        """Some parcel."""
        return self.session.parcels[k % len(self.session.parcels)]

    def on_map(self, xy: np.ndarray) -> np.ndarray:
        """Places on the map."""
        return np.asarray(xy) + np.asarray(self.seen.layout.frame.origin)

    # edits

    @rule()
    def step(self) -> None:
        """Take a level."""
        self.do("step")

    @rule(k=pick, rank=st.integers(1, 7))
    def choose(self, k: int, rank: int) -> None:
        """Choose a cut, perhaps one that there is not."""
        parcel = self.parcel(k)
        found = self.session.candidates(parcel)
        assert [each.rank for each in found] == list(range(1, len(found) + 1))
        n = len(self.session.parcels)
        self.do("choose", parcel=parcel, candidate=rank)
        if rank > len(found):
            assert len(self.session.parcels) == n

    @rule(k=pick, x=share, y=share, turn=share, bend=st.floats(-0.3, 0.3), snap=share)
    def cut(self, k: int, x: float, y: float, turn: float, bend: float, snap: float) -> None:
        """Cut along a line through a parcel."""
        parcel = self.parcel(k)
        low, high = np.reshape(self.seen.polygon(parcel).bounds, (2, 2))
        middle = low + (high - low) * [x, y]
        reach = np.hypot(*(high - low)) * np.array(
            [np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn)]
        )
        kink = middle + bend * reach[::-1] * [-1, 1]
        line = self.on_map(np.array([middle - reach, kink, middle + reach]))
        self.do("cut", parcel=parcel, line=line, snap=None if snap < 0.5 else 4 * snap)

    @rule(k=pick)
    def undo_cut(self, k: int) -> None:
        """Undo a cut."""
        self.do("undo_cut", parcel=self.parcel(k))

    @rule(k=pick, use=st.sampled_from([None, "park", "school"]))
    def lock(self, k: int, use: str | None) -> None:
        """Lock a parcel."""
        self.do("lock", parcel=self.parcel(k), land_use=use)

    @rule(k=pick)
    def unlock(self, k: int) -> None:
        """Unlock a parcel, one that is locked if there is any."""
        locked = np.flatnonzero(self.seen.layout.face_locked)
        self.do("unlock", parcel=self.seen.parcels[locked[k % len(locked)]] if len(locked) else 1)

    @rule(k=pick, more=st.integers(1, 3), use=st.sampled_from([None, "market"]))
    def merge(self, k: int, more: int, use: str | None) -> None:
        """Merge a parcel with some of its neighbours."""
        numbers = [self.parcel(k)]
        sides = self.seen.layout.mesh.face.reshape(-1, 2)
        face = self.seen.parcels.index(numbers[0])
        near = np.unique(sides[(sides == face).any(axis=1)])
        near = near[(near >= 0) & (near != face)]
        numbers += [self.seen.parcels[f] for f in np.roll(near, k)[:more].tolist()]
        self.do("merge", parcels=numbers, land_use=use)

    @rule(ends=st.lists(st.tuples(share, share), min_size=2, max_size=4))
    def draw_street(self, ends: list[tuple[float, float]]) -> None:
        """Draw a street anywhere."""
        low, high = np.reshape(self.land.bounds, (2, 2))
        self.do("add_street", line=self.on_map(low + (high - low) * np.array(ends)), width=12.0)

    @rule(k=pick, a=pick, b=pick)
    def draw_street_through(self, k: int, a: int, b: int) -> None:
        """Draw a street through a parcel, from boundary to boundary and a little on."""
        ring = self.seen.polygon(self.parcel(k)).exterior
        ends = [ring.interpolate(t / 1000, normalized=True).coords[0] for t in (a, b)]
        self.do("add_street", line=self.on_map(np.array(ends)))

    @rule(a=pick, b=pick, street_class=st.sampled_from(["", "collector"]))
    def follow(self, a: int, b: int, street_class: str) -> None:
        """Lay a street along boundaries from one corner to another."""
        xy = self.seen.layout.mesh.xy
        line = self.on_map(xy[[a % len(xy), b % len(xy)]])
        self.do("add_street", line=line, follow=True, street_class=street_class)

    @rule(k=pick)
    def remove_street(self, k: int) -> None:
        """Remove a street."""
        mesh = self.seen.layout.mesh
        edges = np.flatnonzero(self.seen.layout.edge_street)
        edge = edges[k % len(edges)] if len(edges) else 0
        place = self.on_map(mesh.xy[mesh.origin.reshape(-1, 2)[edge]].mean(axis=0))
        self.do("remove_street", place=tuple(place))

    @rule(
        what=st.sampled_from(["nothing", "move", "split", "merge", "street", "no street"]),
        k=pick,
        turn=share,
    )
    def adopt(self, what: str, k: int, turn: float) -> None:
        """Take over the layout's own layers after a small change."""
        layout = self.seen.layout
        mesh = layout.mesh
        edges = mesh.origin.reshape(-1, 2)
        xy = mesh.xy
        if what == "move":
            inner = np.setdiff1d(np.arange(mesh.n_vertices), edges[layout.edge_kind != 0])
            if len(inner):
                xy = xy.copy()
                xy[inner[k % len(inner)]] += [np.cos(7 * turn), np.sin(7 * turn)]
        polygons = list(_polygons(mesh, xy))
        streets = layout.edge_street.copy()
        one = k % len(polygons)
        if what == "split":
            middle = np.array(polygons[one].centroid.coords[0])
            along = 1e4 * np.array([np.cos(7 * turn), np.sin(7 * turn)])
            knife = shapely.LineString([middle - along, middle + along])
            polygons[one : one + 1] = shapely.ops.split(polygons[one], knife).geoms
        elif what == "merge":
            sides = mesh.face.reshape(-1, 2)
            inner = np.flatnonzero((sides >= 0).all(axis=1) & ~layout.edge_street)
            if len(inner):
                a, b = sides[inner[k % len(inner)]].tolist()
                polygons[a] = shapely.union_all([polygons[a], polygons[b]])
                if a != b:
                    del polygons[b]
        elif what == "street":
            streets[k % mesh.n_edges] = True
        elif what == "no street":
            inner = np.flatnonzero(streets & (layout.edge_kind == 0))
            if len(inner):
                streets[inner[k % len(inner)]] = False
        lines = shapely.linestrings(xy[edges[streets]])
        origin = np.asarray(layout.frame.origin)
        parcels, drawn = (
            list(shapely.transform(np.array(each, dtype=object), lambda p: p + origin))
            for each in (polygons, lines)
        )
        self.do("adopt", parcels=parcels, streets=drawn)

    # back and forth

    @rule()
    def undo(self) -> None:
        """Undo; what was there before is there again."""
        self.session.undo()
        self.look()

    @rule()
    def redo(self) -> None:
        """Redo; what was there is there again."""
        self.session.redo()
        self.look()

    @rule(k=pick)
    def go_to(self, k: int) -> None:
        """Go to a branch."""
        branches = self.session.branches()
        self.session.go_to(branches[k % len(branches)].number)
        self.look()

    @precondition(lambda self: len(self.prints) > 1)
    @rule()
    def make_anew(self) -> None:
        """Forget moments: they are made again the same."""
        for entry in self.session._timeline.entries[1:]:
            entry.moment = None
        self.look()

    @rule()
    def save_and_load(self) -> None:
        """Save the session and replay it: the same layout, and all branches with it."""
        with tempfile.TemporaryDirectory() as folder:
            path = self.session.save(Path(folder) / "edits.json")
            again = Session.load(path, self.begun_with)
        assert again.branches() == self.session.branches()
        self.session = again
        self.look()

    @rule()
    def write_and_resume(self) -> None:
        """Write the layout, and begin a session with the file: it goes on the same way."""
        with tempfile.TemporaryDirectory() as folder:
            layout = read_layout(write_layout(self.session.layout, f"{folder}/stage.gpkg")).layout
        again = Session.of_layout(layout)
        assert again.level == self.session.level
        assert again.finished == self.session.finished
        assert_same(self.seen, Seen.of(again))
        if not self.session.finished:
            self.session.step()
            assert_same(Seen.of(self.session), Seen.of(Session.of_layout(layout), "step"))
        self.session, self.begun_with = again, layout
        self.prints = {}
        self.look()

    def teardown(self) -> None:
        """Finish the layout: its certificate holds."""
        if not hasattr(self, "session"):
            return
        amiss = bool(self.seen.unreached), bool(self.seen.small)
        if isinstance(tried(self.session.finish), EditError):
            assert self.session.is_complete
        proof = certificate(self.session.layout)
        excused = {name for name, was in zip(("reached", "min_area"), amiss, strict=True) if was}
        failures = [check for check in proof.failures if check.name not in excused]
        assert not failures, [(check.name, check.message) for check in failures]


def _polygons(mesh: PlanarMesh, xy: np.ndarray) -> np.ndarray:
    """Polygons of the faces of a mesh with its vertices elsewhere."""
    return dataclasses.replace(mesh, xy=xy).face_polygons()


TestSession = SessionMachine.TestCase
TestSession.settings = settings(
    max_examples=20,
    stateful_step_count=14,
    deadline=None,
    derandomize=True,
    suppress_health_check=list(HealthCheck),
)
