"""Code for other processors: it assembles, and gives the same bits where this machine can run it."""

import ctypes
import platform
from dataclasses import replace

import casadi
import numpy as np
import pytest
from casadi import SX
from llvmlite import binding as llvm
from small_functions import mixed, same_bits, traced

from armblocks.compiler import compile_function
from armblocks.compiler.batch import emit_batch
from armblocks.compiler.entry_function import emit_entry
from armblocks.compiler.from_casadi import tape_from
from armblocks.compiler.ir_text import Module
from armblocks.compiler.layout import BatchLayout, Layout
from armblocks.compiler.llvm_ir import emit_function
from armblocks.compiler.native import Effort, NativeCode, _link, compile_object, load_code
from armblocks.compiler.target import Target, host_target, target_features, vector_lanes

LAYOUT = BatchLayout(inputs=(Layout.ROWS, Layout.ROWS), outputs=(Layout.ROWS,))


def module(lanes: int) -> str:
    function = mixed()
    tape = tape_from(function)
    result = Module()
    emit_batch(result, tape, LAYOUT, lanes, "batch")
    emit_function(result, tape, "evaluate", linkage="")
    emit_entry(result, function.inputs, function.outputs, "evaluate")
    return result.text


@pytest.mark.parametrize(
    ("triple", "cpu", "lanes"),
    [
        ("x86_64-unknown-linux-gnu", "x86-64", 2),
        ("x86_64-unknown-linux-gnu", "skylake-avx512", 8),
        ("x86_64-pc-windows-msvc", "x86-64-v3", 4),
        ("x86_64-apple-darwin", "haswell", 4),
        ("aarch64-unknown-linux-gnu", "generic", 2),
        ("arm64-apple-darwin", "apple-m1", 2),
        ("aarch64-pc-windows-msvc", "generic", 2),
    ],
)
def test_code_assembles_for_other_systems(triple: str, cpu: str, lanes: int) -> None:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = replace(host_target(), triple=triple, cpu=cpu, features="", lanes=lanes)
    assert len(compile_object(module(lanes), target)) > 1000


@pytest.mark.parametrize(("cpu", "lanes"), [("x86-64", 1), ("x86-64", 2), ("haswell", 4)])
@pytest.mark.skipif(platform.machine().lower() not in ("x86_64", "amd64"), reason="runs x86-64 code")
def test_older_processors_give_the_same_bits(cpu: str, lanes: int) -> None:
    """Without a fused multiply-add instruction, the exact function of the C library is called."""
    if cpu == "haswell" and not llvm.get_host_cpu_features().get("avx2"):
        pytest.skip("this processor has no AVX2")
    target = replace(host_target(), cpu=cpu, features="", lanes=lanes)
    code = _link(compile_object(module(lanes), target), target)
    function = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 3, *[ctypes.c_void_p] * 3)(code.address("batch"))
    rng = np.random.default_rng(4)
    a, b = rng.normal(size=(101, 3)), rng.normal(size=(101, 3))
    a[7, 0], b[9, 2] = 1e200, 1e12
    out = np.empty((101, 11))
    function(0, 101, 101, a.ctypes.data, b.ctypes.data, out.ctypes.data)
    assert same_bits(out, compile_function(mixed())(a, b))


@pytest.mark.parametrize(
    ("triple", "features", "lanes"),
    [
        ("x86_64-unknown-linux-gnu", {"avx512f": True, "avx2": True, "fma": True}, 8),
        ("x86_64-pc-windows-msvc", {"avx512f": False, "avx2": True, "fma": True}, 4),
        ("x86_64-unknown-linux-gnu", {"avx2": True}, 2),
        ("x86_64-unknown-linux-gnu", {}, 2),
        ("arm64-apple-darwin", {"neon": True}, 2),
    ],
)
def test_the_number_of_lanes_depends_on_the_vector_registers(
    triple: str, features: dict[str, bool], lanes: int
) -> None:
    assert vector_lanes(triple, features) == lanes


@pytest.mark.parametrize(
    ("triple", "features"),
    [
        ("x86_64-unknown-linux-gnu", "+avx2,-prefer-256-bit"),
        ("amd64-unknown-freebsd", "+avx2,-prefer-256-bit"),
        ("aarch64-unknown-linux-gnu", "+avx2"),
        ("arm64-apple-darwin", "+avx2"),
    ],
)
def test_only_x86_64_targets_disable_the_preference_for_256_bits(triple: str, features: str) -> None:
    assert target_features(triple, "+avx2") == features


def negations(a: SX, b: SX) -> SX:
    """Multiply-adds whose sum is exactly zero for a = 3, b = 2, with each kind of negation."""
    rest = [a[k] * b[k] - 6 for k in range(4)]
    return casadi.vertcat(
        -rest[0],
        casadi.if_else(a[4] > 0, -1.0, 1.0) * rest[1],
        casadi.if_else(a[4] > 0, -rest[2], rest[2]),
        casadi.atan2(-rest[3], -1.0),
    )


def test_a_negated_multiply_add_keeps_the_sign_of_zero_in_every_row() -> None:
    count = 19  # rows in full vectors, and a remainder of single rows
    result = compile_function(traced(negations, 5, 5))(np.full((count, 5), 3.0), np.full((count, 5), 2.0))
    assert same_bits(result, np.tile([-0.0, -0.0, -0.0, -np.pi], (count, 1)))


@pytest.mark.parametrize("effort", Effort)
def test_arm64_code_has_no_negated_multiply_add(effort: Effort) -> None:
    """FNMADD computes (-a) b - c, whose exact zero is +0; the negated zero of a b + c is -0."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = replace(host_target(), triple="aarch64-unknown-linux-gnu", cpu="generic", features="", lanes=2)
    result = Module()
    emit_function(result, tape_from(traced(negations, 5, 5)), "evaluate", linkage="")
    code = compile_object(result.text, target, effort=effort)
    words = np.frombuffer(code[: len(code) // 4 * 4], "<u4")
    # C7.2 of the Arm Architecture Reference Manual: FMADD and FNMADD differ in bit 21 (o1), bit 15 (o0) is 0.
    assert np.any((words & 0xFFE08000) == 0x1F400000) or np.any((words & 0xFFE08000) == 0x1F408000)
    assert not np.any((words & 0xFFE08000) == 0x1F600000)


def test_the_host_target_is_detected_once() -> None:
    target = host_target()
    assert isinstance(target, Target)
    assert target is host_target()
    assert target.cpu in target.key
    assert "llvmlite" in target.key
    assert replace(target, lanes=1).key != target.key


def test_an_unknown_symbol_has_no_address() -> None:
    code = load_code(("symbols",), lambda: "define double @known() { ret double 1.0 }")
    assert isinstance(code, NativeCode)
    assert code.address("known") > 0
    with pytest.raises(KeyError, match="unknown"):
        code.address("unknown")


def test_code_for_processors_with_fused_multiply_add_does_not_call_the_c_library() -> None:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    names = (b"sin", b"cos", b"tan", b"atan2", b"exp", b"fmod", b"pow", b"log", b"fma", b"floor")
    for triple, cpu in (("x86_64-unknown-linux-gnu", "haswell"), ("aarch64-unknown-linux-gnu", "generic")):
        target = replace(host_target(), triple=triple, cpu=cpu, features="", lanes=2)
        code = compile_object(module(2), target)
        assert not [name for name in names if b"\0" + name + b"\0" in code]
