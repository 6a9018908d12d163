"""Every tolerance of Python and of the core: what it is, and what must happen when it is changed.

An outward-rounding constant set to zero must fail a test of soundness with an adversarial input. A tolerance times 1000
must fail a test of tightness; a heuristic one, which decides only how much work is done or how wide a set is, must
leave `tests/soundness_core` green. The table of `docs/theory.md` has the same rows (`test_table.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Literal

from tests.mutation.plugin import defined

Kind = Literal["outward", "tolerance", "heuristic"]
CORE = "tests/soundness_core"
EPS = 2.0**-52


@dataclass(frozen=True)
class Constant:
    """A number in a module or a file of the core, and the test that must notice its change (none if heuristic)."""

    module: str
    name: str
    kind: Kind
    test: str = CORE

    def __str__(self) -> str:
        return f"{self.module}:{self.name}"

    @property
    def value(self) -> float:
        if "/" in self.module:
            value, _, unit = defined(self.module, self.name).partition(" * ")
            return (float.fromhex(value) if "0x" in value else float(value)) * (EPS if unit else 1.0)
        return float(getattr(import_module(self.module), self.name))

    @property
    def changed(self) -> float:
        """The value of the mutant: a count stays one."""
        value = 0.0 if self.kind == "outward" else 1000.0 * self.value
        return round(value) if self.value > 1.0 and value.is_integer() else value


ROUNDED = f"{CORE}/test_rounding_outward.py"
SETS = "tests/polytopes"
POLYTOPE = "tests/svo/observers/polytope"
WINDOW = "tests/svo/observers/window"
LONG = f"{WINDOW}/test_long_windows.py"
TAPES = "tests/svo/functions"

CONSTANTS = (
    Constant("svo.models.discretisation", "_ROUNDED_UP", "outward", "tests/svo/models/test_inside_a_sample.py"),
    Constant("svo.analysis.reachable_set", "_ROUNDING", "outward", "tests/svo/analysis/test_reachable_set.py"),
    Constant("svo.analysis.explanation", "ROUNDING", "outward", "tests/svo/analysis/test_calibration.py"),
    Constant("svo.models.state_range", "_EPS", "outward", ROUNDED),
    Constant("svo.observers.zonotope.zonotope", "EPS", "outward", CORE),
    Constant("svo.observers.polytope.vertex_images", "_OUTWARD", "outward", ROUNDED),
    Constant("svo.observers.polytope.output_rows", "_ROUNDING", "outward", f"{POLYTOPE}/test_rounding_of_rows.py"),
    Constant("svo.observers.window.output_injection", "_UNIT", "outward", ROUNDED),
    Constant(
        "core/window/motion.c",
        "UNIT",
        "outward",
        f"{LONG}::test_the_rounding_of_the_state_is_within_its_bound_and_the_bound_is_small",
    ),
    Constant(
        "core/window/rounding.c",
        "ORTHOGONALITY",
        "outward",
        f"{LONG}::test_what_carries_an_error_bounds_the_exact_product_of_the_frames",
    ),
    Constant("core/window/factors.c", "UNIT", "outward", "tests/svo/observers/test_random_units.py"),
    Constant("core/window/window.h", "UNIT", "outward", f"{WINDOW}/test_chain.py"),
    Constant("core/interval/predictor.c", "SLACK", "outward", "tests/svo/interval"),
    Constant("core/polytopes/sums.h", "TINY", "outward", f"{SETS}/test_simplex_kernel.py"),
    *(
        Constant(f"core/tape/{file}.c", f"{name}_ERROR", "outward", "tests/core/test_elementary.py")
        for file, name in (
            ("exponential", "EXP"),
            ("exponential", "TANH"),
            ("logarithm", "LOG"),
            ("waves", "WAVE"),
            ("angle", "ANGLE"),
        )
    ),
    Constant("core/tape/intervals.h", "OUTWARD", "outward", f"{TAPES}/test_tape_operations.py"),
    Constant("core/tape/forms.c", "ROUNDED", "outward", f"{TAPES}/test_random_tapes.py"),
    Constant("core/tape/plant.h", "ROUNDING", "outward", "tests/svo/models/test_core_transitions.py"),
    *(
        Constant("core/tape/matrix_exponential.c", name, "outward", "tests/svo/models/test_enclosed_exponential.py")
        for name in ("ROUNDED", "TAIL", "VANISHED")
    ),
    Constant("core/polytopes/facets.c", "TOLERANCE", "tolerance", f"{SETS}/test_row_redundancy.py"),
    *(
        Constant(f"core/{file}", name, "heuristic")
        for file, names in {
            "polytopes/simplex.c": (
                "PIVOT",
                "RAY",
                "PRICE",
                "CERTAIN",
                "HARRIS",
                "DEGENERATE",
                "FREE_FIRST",
                "REFACTOR",
            ),
            "polytopes/basis.c": ("RAY",),
            "polytopes/facets.c": ("CLEAR", "BELOW", "FLAT_ROW", "RELAXED", "AWAY", "CLARKSON_FROM"),
            "polytopes/clarkson.c": ("TOGETHER", "CORNERS", "FRESH"),
            "polytopes/elimination.c": ("LONG", "GROWTH", "CANCELLED"),
            "polytopes/centre.c": ("ROUNDED_SLACK",),
            "polytopes/cone.c": ("DEPENDENT",),
            "polytopes/near_cone.c": ("ON", "BESIDE", "SURE", "INDEPENDENT", "SINGULAR", "MOVED"),
            "polytopes/bounded_sets.c": ("NARROW", "STEEP"),
            "polytopes/volume.c": ("STEPS",),
            "polytopes/questions.c": ("TIGHT", "LOST", "ROOMY", "NOISE"),
            "polytopes/programs.c": ("CHAINED",),
            "polytopes/scaling.c": ("SWEEPS", "STILL"),
            "polytopes/sums.h": ("UNDERFLOW_BELOW",),
            "tape/secants.c": ("NEAR", "FLAT_ROOT", "PIECE", "BENDS_BOTH_WAYS", "FAR"),
            "tape/form_of_angle.c": ("NO_DIRECTION",),
            "tape/enclosure.c": ("WORTHWHILE",),
            "tape/transition.c": ("WORTH_ANOTHER",),
            "tape/short_rows.c": ("DROPPED",),
            "tape/output.c": ("BLUNT", "WORTHWHILE"),
            "tape/matrix_exponential.c": ("LAST",),
            "relinearised/follow.c": ("SMALL",),
            "window/factors.c": ("LEFT_OVER", "TOO_MUCH"),
            "window/ratio_test.c": ("SMALL_PIVOT", "NO_PIVOT", "SAME"),
            "window/dual_simplex.c": ("FEASIBILITY", "NEAR_WORST", "REFACTOR", "STALLED"),
            "window/maximise.c": ("SMALL_GAP", "GAP", "LONG", "LARGE_JITTER", "LESS_JITTER"),
            "window/window.h": ("CLEAN_PIVOT", "SAFE_PIVOT"),
        }.items()
        for name in names
    ),
    Constant("svo.residual_tests.threshold", "_ROUNDING", "outward", "tests/svo/residual_tests"),
    Constant("svo.interval.thresholds", "_EPS", "outward", "tests/svo/interval/test_rounding.py"),
    Constant("polytopes.outer_supports", "_EPS", "outward", f"{SETS}/test_outward.py"),
    Constant("polytopes.outward_normals", "_EPS", "outward", f"{SETS}/test_outward.py"),
    Constant("polytopes.duality", "_EPS", "outward", ROUNDED),
    Constant("polytopes.affine", "_EPS", "outward", ROUNDED),
    Constant("polytopes.linear_program", "_EPS", "outward", f"{SETS}/test_outward.py"),
    Constant("polytopes.hull", "_EPS", "outward", f"{SETS}/test_outward.py"),
    Constant("polytopes.affine_image", "_EPS", "outward", f"{SETS}/test_outward.py"),
    Constant("polytopes.preimage", "_EPS", "outward", f"{SETS}/test_outward.py"),
    Constant("polytopes.inclusion", "_EPS", "outward", f"{SETS}/test_operators.py"),
    Constant("polytopes.distance", "_EPS", "outward", f"{SETS}/test_distances.py"),
    Constant("polytopes.normalisation", "_EPS", "outward", f"{SETS}/test_operators.py"),
    Constant("core/polytopes/centre.c", "EPS", "outward", ROUNDED),
    Constant("svo.logs.columns", "TIME_TOLERANCE", "tolerance", "tests/svo/logs/test_log_file.py"),
    Constant("svo.isolation.containment", "_ROUNDING", "tolerance", "tests/svo/isolation/test_bank_of_kind_one.py"),
    Constant("svo.logs.dialect.grid", "_FITS", "tolerance", "tests/svo/logs/dialect/test_wide_text.py"),
    Constant("svo.logs.dialect.grid", "_FASTER", "tolerance", "tests/svo/logs/dialect/test_wide_text.py"),
    Constant("svo.logs.dialect.grid", "_ROUNDING", "heuristic"),
    Constant(
        "svo.analysis.model_pair", "LEAST_SEPARATION", "tolerance", "tests/svo/analysis/test_distinguishability.py"
    ),
    Constant("svo.faults.profiles", "EDGE_TOLERANCE_S", "tolerance", "tests/svo/faults/test_faults.py"),
    Constant("svo.baselines.kalman", "_STABLE", "tolerance", "tests/svo/baselines/test_filters.py"),
    Constant("svo.baselines.kalman", "_UNSEEN", "tolerance", "tests/svo/baselines/test_filters.py"),
    Constant("svo.baselines.parity", "_TRACE", "tolerance", "tests/svo/baselines/test_parity.py"),
    Constant("svo.analysis.elastic_program", "ROUNDING", "heuristic"),
    Constant("svo.analysis.explanation", "NEGLIGIBLE", "heuristic"),
    Constant("svo.analysis.explanation", "_PULL", "heuristic"),
    Constant("svo.analysis.input_design", "_DECREASE", "heuristic"),
    Constant("svo.analysis.sparse_program", "FEASIBILITY", "heuristic"),
    Constant("svo.analysis.model_pair", "_DELTA_TOLERANCE", "heuristic"),
    Constant("svo.observers.window.restarting", "_BLURRED", "heuristic"),
    Constant("svo.observers.window.prover", "_EPS", "heuristic"),
    Constant("svo.observers.window.chain_starts", "_ROUNDED_UP", "heuristic"),
    Constant("svo.observers.window.sign_split", "_INEXACT", "heuristic"),
    Constant("svo.observers.window.hints", "_MARGIN", "heuristic"),
    Constant("svo.observers.window.hints", "_OTHERWISE", "heuristic"),
    Constant("svo.observers.zonotope.zonotope", "_PIVOT", "heuristic"),
    Constant("svo.observers.zonotope.reduction", "_RANK", "heuristic"),
    Constant("svo.observers.zonotope.reduction", "_EQUALITY", "heuristic"),
    Constant("svo.observers.zonotope.program", "_INSIDE", "heuristic"),
    Constant("svo.observers.zonotope.program", "_MISFIT", "heuristic"),
    Constant("svo.detectors.interval", "_HAIR", "heuristic"),
    Constant("polytopes.pontryagin_difference", "_CONSTANT", "heuristic"),
    Constant("polytopes.pontryagin_difference", "_ROUNDED", "heuristic"),
    Constant("polytopes.hull", "_FLAT", "heuristic"),
    Constant("polytopes.hull", "_NOISE", "heuristic"),
    Constant("polytopes.hull", "_TOUCHING", "heuristic"),
    Constant("polytopes.hull", "_ALIKE", "heuristic"),
    Constant("polytopes.hull", "_REACHED", "heuristic"),
    Constant("polytopes.vertices", "_SAME", "heuristic"),
    Constant("polytopes.vertices", "_RANK", "heuristic"),
    Constant("polytopes.linear_program", "CLEAN", "heuristic"),
    Constant("polytopes.containment", "_DOUBTFUL", "heuristic"),
    Constant("polytopes.linear_program", "_THIN", "heuristic"),
    Constant("polytopes.linear_program", "_LOST", "heuristic"),
    Constant("polytopes.linear_program", "SMALL_BALL", "heuristic"),
    Constant("polytopes.linear_program", "_NOISE", "heuristic"),
    Constant("polytopes.linear_program", "SHARP", "heuristic"),
    Constant("polytopes.large_program", "_USED", "heuristic"),
    Constant("polytopes.certificate", "_ZERO_WEIGHT", "heuristic"),
    Constant("polytopes.frame", "_NOISE", "heuristic"),
    Constant("polytopes.hull", "_SLIVER", "heuristic"),
    Constant("polytopes.exact", "_CANCELLING", "heuristic"),
    Constant("polytopes.least_distance", "_STILL", "heuristic"),
    Constant("polytopes.ellipsoids", "_OPTIMAL", "heuristic"),
    Constant("svo.analysis.invariant_sets", "_INWARD", "heuristic"),
    Constant("svo.analysis.invariant_sets", "_SLACK", "heuristic"),
    Constant("svo.observers.window.certificate", "_MOST_WORK", "heuristic"),
    Constant("svo.observers.proof_record", "_MOST_SAMPLES", "heuristic"),
    Constant("svo.isolation.alarm_record", "_MOST_ENTRIES", "heuristic"),
    Constant("svo.store.packed_lines", "_MOST_TIMES", "heuristic"),
    Constant("svo.store.packed_lines", "_MEMBER", "heuristic"),
    Constant("polytopes.general_position", "WIDE", "heuristic"),
    Constant("polytopes.plotting", "_REACH", "heuristic"),
)
