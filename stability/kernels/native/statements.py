"""Statements of the kernels' language: assignment, loops over ranges, while, if, break, continue, return.

Every variable has one type for the whole function, that of its first assignment (an integer that is put into a float
variable becomes a float). Variables are slots on the stack, which LLVM turns into registers.
"""

from __future__ import annotations

import ast
from typing import Any

from .expressions import Expressions
from .values import Block, Kind, Scalar, Value, flat, is_array, kind_of, parts

__all__ = ["Statements"]


class Statements(Expressions):
    """Writes instructions for statements; `results` is the type of the function's result once it is known."""

    def __init__(self) -> None:
        super().__init__()
        self.names: dict[str, tuple[Kind, list[str]]] = {}  # variable -> type, its stack slots
        self.loops: list[tuple[str, str]] = []  # (label of the next round, label behind the loop)
        self.results: tuple[Kind, ...] | None = None
        self.result_slots: list[str] = []

    # ------------------------------------------------------------------ variables
    def variable(self, name: str) -> Value:
        """The value of a local variable."""
        return self.got(*self.names[name])

    def bind(self, name: str, value: Value, node: ast.AST) -> None:
        """name = value."""
        if name not in self.names:
            kind = kind_of(value)
            self.names[name] = kind, [self.slot(llvm) for llvm in flat(kind)]
        kind, slots = self.names[name]
        self.put(self.argument(value, kind, node), slots)

    def argument(self, value: Value, kind: Kind, node: ast.AST) -> Value:
        """A value as one of a given type."""
        if isinstance(kind, str) and not is_array(kind):
            return self.number_as(value, kind, node)
        if kind_of(value) != kind:
            raise self.refuse(node, f"a value of type {kind} is needed")
        return value

    def assign(self, target: ast.expr, value: Value) -> None:
        """One target, or several, of an assignment."""
        match target:
            case ast.Name(id="_"):
                return
            case ast.Name(id=name):
                self.bind(name, value, target)
                return
            case ast.Tuple(elts=items) if isinstance(value, tuple) and len(items) == len(value):
                for item, one in zip(items, value):
                    self.assign(item, one)
                return
            case ast.Subscript(slice=ast.Slice(lower=None, upper=None, step=None)) if not isinstance(value, Block):
                self.fill(self.block(target.value), value, target)
                return
            case ast.Subscript() if not isinstance(value, Block):
                array, pointer = self.target(target)
                self.stored(array.element, pointer, value, target)
                return
        raise self.refuse(target, "not a thing that this value can be assigned to")

    def target(self, node: ast.Subscript) -> tuple[Block, str]:
        """The array and the pointer to the element that is assigned to."""
        array = self.block(node.value)
        found, cut = self.indices(array, node)
        if cut is not None or len(found) != len(array.shape):
            raise self.refuse(node, "an element of an array is needed")
        return array, self.place(array, found)

    def fill(self, array: Block, value: Value, node: ast.AST) -> None:
        """array[:] = number."""
        total = self.total(array)
        line = Block(array.element, array.data, (total,))
        self.counted("0", total, "1", lambda k: self.stored(array.element, self.place(line, [k]), value, node))

    def augment(self, node: ast.AugAssign) -> None:
        """target op= value; the place is computed once."""
        operation = type(node.op).__name__
        if isinstance(node.target, ast.Name):
            value = self.arithmetic(node, operation, self.expression(node.target), self.expression(node.value))
            self.bind(node.target.id, value, node)
        elif isinstance(node.target, ast.Subscript):
            array, pointer = self.target(node.target)
            change = self.expression(node.value)
            value = self.arithmetic(node, operation, self.loaded(array.element, pointer), change)
            self.stored(array.element, pointer, value, node)
        else:
            raise self.refuse(node, "no such target")

    # ------------------------------------------------------------------ control
    def block_of(self, body: list[ast.stmt]) -> None:
        """Statements in order."""
        for statement in body:
            self.statement(statement)

    def statement(self, node: ast.stmt) -> None:
        """Any statement."""
        match node:
            case ast.Expr(value=ast.Constant()):
                return
            case ast.Expr(value=ast.Call()):
                self.expression(node.value)
            case ast.Assign():
                value = self.expression(node.value)
                for target in node.targets:
                    self.assign(target, value)
            case ast.AugAssign():
                self.augment(node)
            case ast.If():
                self.branch(node)
            case ast.For(iter=ast.Call(func=ast.Name(id="range"))) if not node.orelse:
                self.loop_over_range(node)
            case ast.While() if not node.orelse:
                self.loop_while(node)
            case ast.Break():
                self.jump(self.loops[-1][1])
            case ast.Continue():
                self.jump(self.loops[-1][0])
            case ast.Return():
                self.give(node)
            case _:
                raise self.refuse(node, "no such statement in a kernel")

    def jump(self, label: str) -> None:
        """Leave this basic block; what follows is not reached."""
        self.lines += [f"  br label %{label}", f"{self.new('dead')}:"]

    def branch(self, node: ast.If) -> None:
        """if ... else."""
        condition = self.condition(node.test)
        yes, no, after = self.new("L"), self.new("L"), self.new("L")
        self.lines += [f"  br i1 {condition}, label %{yes}, label %{no if node.orelse else after}", f"{yes}:"]
        self.block_of(node.body)
        if node.orelse:
            self.lines += [f"  br label %{after}", f"{no}:"]
            self.block_of(node.orelse)
        self.label(after)

    def counted(self, start: str, stop: str, step: str, body: Any) -> None:
        """Loop of a hidden counter; body(register of the counter)."""
        counter = self.slot("i64")
        head, inside, further, after = self.new("L"), self.new("L"), self.new("L"), self.new("L")
        self.lines.append(f"  store i64 {start}, ptr {counter}")
        self.label(head)
        now = self.write(f"load i64, ptr {counter}")
        more = self.write(f"icmp {'sgt' if step.startswith('-') else 'slt'} i64 {now}, {stop}")
        self.lines += [f"  br i1 {more}, label %{inside}, label %{after}", f"{inside}:"]
        self.loops.append((further, after))
        body(now)
        self.loops.pop()
        self.label(further)
        following = self.write(f"add nsw i64 {now}, {step}")
        self.lines += [f"  store i64 {following}, ptr {counter}", f"  br label %{head}", f"{after}:"]

    def loop_over_range(self, node: ast.For) -> None:
        """for name in range(...); a step that is not a literal is positive."""
        assert isinstance(node.iter, ast.Call)
        arguments, step, name = node.iter.args, "1", node.target
        if len(arguments) == 3:
            step = self.integer(arguments[2])
        start = "0" if len(arguments) == 1 else self.integer(arguments[0])
        stop = self.integer(arguments[0] if len(arguments) == 1 else arguments[1])

        def body(now: str) -> None:
            self.assign(name, Scalar("i", now))
            self.block_of(node.body)

        self.counted(start, stop, step, body)

    def loop_while(self, node: ast.While) -> None:
        """while condition."""
        head, inside, after = self.new("L"), self.new("L"), self.new("L")
        self.label(head)
        condition = self.condition(node.test)
        self.lines += [f"  br i1 {condition}, label %{inside}, label %{after}", f"{inside}:"]
        self.loops.append((head, after))
        self.block_of(node.body)
        self.loops.pop()
        self.lines += [f"  br label %{head}", f"{after}:"]

    def give(self, node: ast.Return) -> None:
        """return."""
        value = self.expression(node.value) if node.value is not None else ()
        values = value if isinstance(value, tuple) else (value,)
        if self.results is None:
            self.results = tuple(kind_of(one) for one in values)
        if not self.result_slots:
            self.result_slots = [self.slot(llvm) for llvm in flat(self.results)]
        if len(values) != len(self.results):
            raise self.refuse(node, f"{len(self.results)} results are needed")
        fitting = [self.argument(one, kind, node) for one, kind in zip(values, self.results)]
        types = [llvm for kind in self.results for llvm in flat(kind)]
        for llvm, slot, register in zip(types, self.result_slots, parts(tuple(fitting))):
            self.lines.append(f"  store {llvm} {register}, ptr {slot}")
        self.jump("leave")
