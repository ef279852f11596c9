"""Many steps of a MuJoCo model in one call, without Python between them: perp_contact_solver_run
with MuJoCo's own functions as its stages. Python is asked where other things touch."""

from __future__ import annotations

import ctypes
import functools
import glob
import os
import queue
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Callable, NamedTuple, Optional

import mujoco as mj  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

from . import _arrays
from . import _mujoco_model as _model
from ._errors import argument_error
from ._generated import (
    CONSTANTS,
    ContactCopy,
    ContactIntegrate,
    ContactInvert,
    ContactRun,
    ContactStage,
)
from ._library import library
from ._stepper import Solved
from ._structures import sized

Array = NDArray[np.float64]

_SOLVE, _MOVE = CONSTANTS["PERP_CONTACT_PHASE_SOLVE"], CONSTANTS["PERP_CONTACT_PHASE_MOVE"]
_DONE, _OTHER = CONSTANTS["PERP_CONTACT_WAIT_DONE"], CONSTANTS["PERP_CONTACT_WAIT_OTHER"]
_NEARLY = 1e-6  # of what drives a step: slower may be at rest
_SLOW = 100.0  # times tol: slower slips may be held
_AGAIN = "mj_fwdPosition", "mj_fwdVelocity", "mj_fwdActuation", "mj_fwdAcceleration"


class Copy(NamedTuple):
    """Numbers of data, and theirs in each step: a row of `rows`."""

    data: Array
    rows: Array


@functools.lru_cache(maxsize=None)
def _functions() -> Any:
    """MuJoCo's own library, which the package has loaded; None where it is not found."""
    folder = os.path.dirname(mj.__file__)
    found = glob.glob(f"{folder}/libmujoco*") + glob.glob(f"{folder}/mujoco.dll")
    return ctypes.CDLL(found[0]) if found else None


def _stages(*names: str) -> list[Any]:
    functions = _functions()
    return [ctypes.cast(getattr(functions, name), ContactStage) for name in names]


class _Callbacks:
    """Whether MuJoCo calls functions of Python's: asked where one has changed."""

    def __init__(self) -> None:
        names = [name for name in dir(mj) if name.startswith("get_mjcb_")]
        self._getters = [getattr(mj, name) for name in names]
        functions, size = _functions(), ctypes.sizeof(ctypes.c_void_p)
        cells = [ctypes.c_void_p.in_dll(functions, name[4:]) for name in names]
        places = [ctypes.addressof(x) for x in cells]
        begin, end = min(places), max(places) + size  # they lie beside each other
        self.cells = (ctypes.c_char * (end - begin)).from_address(begin)
        self.none = b""  # what they were when there was none

    def are_there(self) -> bool:
        now = self.cells.raw
        if now != self.none and all(get() is None for get in self._getters):
            self.none = now
        return now != self.none


_callbacks = functools.lru_cache(maxsize=None)(_Callbacks)


def has_callbacks() -> bool:
    """Whether MuJoCo may call functions of Python's."""
    return _functions() is None or bool(_callbacks().are_there())


class Runner:
    """Runs of one stepper on one data."""

    GATHERED = _SOLVE  # the phase of a step that has been gathered

    def __init__(self, stepper: Any, data: Any) -> None:
        stepper.bind(data)
        self._stepper, self._data = stepper, data
        self._run, self._begun = sized(ContactRun), False
        self._fit: Optional[bytes] = None
        self._room = data.narena // 2
        self._lent, self._callbacks = stepper.borrowed.lent, _callbacks()
        self._kept: list[Any] = []
        run, model = self._run, stepper.model
        run.model, run.data = model._address, data._address
        run.places, run.time = model.nq, data._address + _model.layout().time
        room = self._keep(np.zeros(model.nq + 2 * model.nv))
        for name, array in ("place", data.qpos), ("velocity", data.qvel), ("room", room):
            setattr(run, name, _arrays.address(array))
        run.integrate = ctypes.cast(_functions().mj_integratePos, ContactIntegrate)
        run.look_slip = _SLOW * stepper.solver.tol
        run.look_rest = _NEARLY if stepper.large else 0.0
        run.drive = _arrays.address(data.qacc_smooth)
        self._set_stages()

    @staticmethod
    def can(stepper: Any, data: Any) -> bool:
        """Whether its steps need nothing of Python's between those of MuJoCo, but for sensors."""
        stages = stepper.model.opt.integrator == _model.RK4
        return not (stages and stepper.model.na) and Runner.can_end(stepper, data)

    @staticmethod
    def can_end(stepper: Any, data: Any) -> bool:
        """Whether a step needs none once it is gathered. An error of MuJoCo's is one of Python's
        only where Python calls it: where memory may run out, too."""
        fast = stepper.model.opt.integrator == _model.FAST
        inner = stepper.damping.changes or (fast and stepper.tumbling is not None)
        short = 2 * data.maxuse_arena > data.narena
        return stepper.rigid and not (inner or short or has_callbacks())

    def _keep(self, thing: Any) -> Any:
        self._kept.append(thing)
        return thing

    def _set_stages(self) -> None:
        run, stepper = self._run, self._stepper
        fast = stepper.model.opt.integrator == _model.FAST
        after = ["mj_rnePostConstraint"] if stepper.accelerates else []
        after += ["mj_sensorAcc"] if stepper.senses else []
        stages = {
            "before": _stages("mj_step1", "mj_fwdActuation", "mj_fwdAcceleration"),
            "after": _stages(*after),
            "advance": _stages(*(["mj_Euler"] if stepper.advances else [])),
            "again": _stages(*(_AGAIN if stepper.model.opt.integrator == _model.RK4 else [])),
        }
        if stepper.accelerates and (fast or stepper.model.dof_damping.any()):
            run.invert = ctypes.cast(_functions().mj_solveM, ContactInvert)
        for name, functions in stages.items():
            setattr(run, name, self._keep((ContactStage * max(len(functions), 1))(*functions)))
            setattr(run, name + "_count", len(functions))
        if fast:
            self._set_metric()

    def _set_metric(self) -> None:
        """What implicitfast takes implicitly."""
        run, data, model = self._run, self._data, self._stepper.model
        run.metric = self._keep(_stages("mj_implicit"))[0]
        places = self._keep(np.asarray(model.mapD2M, dtype=np.int32))
        arrays = {
            "metric_M": data.M, "metric_D": data.qDeriv, "metric_mass": self._stepper.mass,
            "metric_places": places,
        }  # fmt: skip
        for name, array in arrays.items():
            setattr(run, name, _arrays.address(array))
        run.metric_count = len(places)
        names = "qpos", "qvel", "act", "history", "plastic", "plugin_state"
        state = [getattr(data, name) for name in names if hasattr(data, name)]
        kept = [(_arrays.address(x), x.size) for x in state if x.size] + [(run.time, 1)]
        copies = self._keep((ContactCopy * len(kept))())
        for copy, (at, count) in zip(copies, kept):
            copy.to, copy.count = _arrays.address(self._keep(np.zeros(count))), count
            copy.source = at
        run.kept, run.kept_count = copies, len(kept)

    def _copies(self, copies: Sequence[Copy], inward: bool) -> Any:
        array = (ContactCopy * max(len(copies), 1))()
        for one, (data, rows) in zip(array, copies):
            at, out = _arrays.address(data), rows.ctypes.data
            one.to, one.source = (at, out) if inward else (out, at)
            one.count, one.stride = data.size, rows.strides[0] // rows.itemsize
        return array

    def __call__(
        self, steps: int, inputs: Sequence[Copy], outputs: Sequence[Copy], phase: int = 0
    ) -> None:
        """So many steps, each with a row of the inputs, and with one of the outputs behind it;
        phase: of the first one, of which the caller has made those before."""
        run, stepper, data = self._run, self._stepper, self._data
        run.input_count, run.output_count = len(inputs), len(outputs)
        if inputs or outputs:
            run.inputs, run.outputs = self._copies(inputs, True), self._copies(outputs, False)
        run.steps, run.done, run.phase, run.unsolved, run.residual = steps, 0, phase, 0, 0.0
        if not self._begun and phase == 0:  # what MuJoCo refuses, it refuses here
            stepper.gather(data)
            self._begun = True
        if steps:
            self._make()
        run.steps, run.input_count, run.output_count = 1, 0, 0

    def _make(self) -> Solved:
        """Those that are left, of which there is one. Returns how the last one ended."""
        run, stepper, data = self._run, self._stepper, self._data
        solver = stepper.solver
        while True:
            if not stepper.dense and stepper.touching is None:
                solver.watch_nothing()
            try:
                how: Solved = solver.run(run)
            except ValueError:
                if run.phase != _SOLVE:
                    raise
                self._moved(stepper.solve(data), run)
                continue
            if run.wait == _DONE:
                return how
            if run.wait == _OTHER:
                stepper.arrange(data)
            else:
                solver.patience = run.patience + 1
                self._moved(how, run)

    def _moved(self, how: Any, run: Any) -> None:
        """Solved here: the rest of the step is the run's."""
        stepper = self._stepper
        if not stepper.solver.known:
            stepper.look(self._data, how)
        run.patience = max(stepper.solver.patience, 0)
        run.phase = _MOVE

    def fit(self) -> None:
        """can() says so, of the model's options as they are."""
        self._fit = self._lent.theirs

    def one(self, data: Any) -> Optional[Solved]:
        """The next step, where can() says so for it, too: nothing is new but data's state. Not
        within Borrowed: what that does is done here, as each call costs a small robot's step a part
        of its time."""
        lent, run = self._lent, self._run
        if (
            data is not self._data
            or data.maxuse_arena > self._room
            or self._callbacks.cells.raw != self._callbacks.none
        ):
            return None
        with lent.lock:
            if lent.theirs is not self._fit:
                return None
            if not lent.users:
                if lent.cells.raw != lent.mine:
                    return None
                lent.taken.raw = lent.theirs
            lent.users += 1
        try:
            run.done = run.phase = 0
            return self._make()
        finally:
            lent.give_back()

    @property
    def unsolved(self) -> int:
        return int(self._run.unsolved)

    @property
    def residual(self) -> float:
        return float(self._run.residual)


class Rollout(NamedTuple):
    """What rollout() saw. Rows belong to starts, and in them to steps."""

    states: Array  # (starts, steps, mj_stateSize(model, mjSTATE_FULLPHYSICS))
    sensors: Array  # (starts, steps, nsensordata)
    unsolved: NDArray[Any]  # of each start: how many steps had no good outcome
    residual: Array  # of each: the worst one

    @property
    def ok(self) -> bool:
        """Whether every step was solved, or as near as a double can come."""
        return not self.unsolved.any()


_STATE = int(mj.mjtState.mjSTATE_FULLPHYSICS)
# Of that state, in its order; what a version of MuJoCo does not have is not in its state.
_PARTS = "qpos", "qvel", "act", "history", "plugin_state", "plastic"


class Batch:
    """One model from many states, each in one thread from begin to end, so that bits do not depend
    on how many there are."""

    def __init__(self, model: Any, make: Callable[[], Any], states: Array, controls: Array) -> None:
        self._model, self._make = model, make
        self._states, self._controls = states, controls
        starts, steps = controls.shape[:2]
        size = states.shape[1]
        self.result = Rollout(
            np.zeros((starts, steps, size)), np.zeros((starts, steps, model.nsensordata)),
            np.zeros(starts, dtype=int), np.zeros(starts),
        )  # fmt: skip
        self._left: queue.SimpleQueue[int] = queue.SimpleQueue()  # starts that no thread has taken

    def run(self, threads: int) -> Rollout:
        for k in range(len(self._controls)):
            self._left.put(k)
        with _model.Borrowed(self._model), ThreadPoolExecutor(threads) as pool:
            others = [pool.submit(self._some) for _ in range(threads - 1)]
            self._some()  # this thread is one of them
            for one in others:
                one.result()
        return self.result

    def _some(self) -> None:
        """What one thread makes: the next start that is left, until there is none."""
        data, stepper = mj.MjData(self._model), self._make()
        try:
            while True:
                self._one(self._left.get_nowait(), data, stepper)
        except queue.Empty:
            pass
        except BaseException:  # Ctrl-C, too: nobody begins another one
            self._left = queue.SimpleQueue()
            raise

    def _one(self, k: int, data: Any, stepper: Any) -> None:
        model = self._model
        stepper.begin_anew()
        mj.mj_resetData(model, data)
        mj.mj_setState(model, data, self._states[k], _STATE)
        inputs = [Copy(data.ctrl, self._controls[k])] if model.nu else []
        steps = self._controls.shape[1]
        if Runner.can(stepper, data):
            runner = Runner(stepper, data)
            runner(steps, inputs, self._outputs(k, data))
            self.result.unsolved[k], self.result.residual[k] = runner.unsolved, runner.residual
        else:
            self._by_steps(k, stepper, data)

    def _outputs(self, k: int, data: Any) -> list[Copy]:
        states, sensors = self.result.states[k], self.result.sensors[k]
        time = np.frombuffer(_memory(data._address + _model.layout().time), dtype=np.float64)
        outputs, begin = [Copy(time, states[:, :1])], 1
        for name in _PARTS:
            part = getattr(data, name, np.zeros(0))
            if part.size:
                outputs.append(Copy(part, states[:, begin : begin + part.size]))
                begin += part.size
        return outputs + ([Copy(data.sensordata, sensors)] if sensors.size else [])

    def _by_steps(self, k: int, stepper: Any, data: Any) -> None:
        result = self.result
        for step, control in enumerate(self._controls[k]):
            data.ctrl[:] = control
            how = stepper.step(data)
            result.unsolved[k] += not how.ok
            result.residual[k] = max(result.residual[k], how.residual)
            mj.mj_getState(self._model, data, result.states[k, step], _STATE)
            result.sensors[k, step] = data.sensordata


def _memory(address: int) -> Any:
    """One number there."""
    return (ctypes.c_double * 1).from_address(address)


def checked(model: Any, states: Any, controls: Any, steps: Optional[int]) -> tuple[Array, Array]:
    """(starts, size of a state) and (starts, steps, nu), from what may be one of each for all."""
    size = mj.mj_stateSize(model, _STATE)
    states = np.atleast_2d(_arrays.real(states, "states"))
    if states.ndim != 2 or states.shape[1] != size:
        raise argument_error(f"states has shape {states.shape}, expected (starts, {size})")
    if controls is None:
        if steps is None:
            raise argument_error("controls is None, and so is steps")
        controls = np.zeros((1, steps, model.nu))
    controls = _arrays.real(controls, "controls")
    controls = controls[None] if controls.ndim == 2 else controls
    if controls.ndim != 3 or controls.shape[2] != model.nu:
        shape = f"(starts, steps, {model.nu})"
        raise argument_error(f"controls has shape {controls.shape}, expected {shape}")
    if steps is not None and steps != controls.shape[1]:
        raise argument_error(f"steps is {steps}, but controls has {controls.shape[1]}")
    starts = max(len(states), len(controls))
    if not {len(states), len(controls)} <= {1, starts}:
        raise argument_error(f"states are {len(states)}, but controls {len(controls)}")
    return (
        np.ascontiguousarray(np.broadcast_to(states, (starts, size))),
        np.ascontiguousarray(np.broadcast_to(controls, (starts, *controls.shape[1:]))),
    )
