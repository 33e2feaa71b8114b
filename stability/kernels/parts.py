"""Functions that are only called by kernels, compiled as parts of them.

numba compiles every function by itself to the end, optimised machine code, and then links a copy of it into each of its
callers, which is optimised and becomes machine code again. For functions that nobody else calls the first of these is
thrown away: a sixth of the time of a first compilation. Here they end as they are lowered (numba's passes over single
functions included, without which kernels are a tenth slower), and what they are linked into is optimised once.

The way in is numba's documented one, a compiler class with a pass of its own (its developer manual, "Customizing the
compiler"); the library leaves out two steps of numba's. If another version of numba does not know them by the same
names, they are done, and nothing else changes.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import IRLegalization

__all__ = ["PartCompiler"]


class _Part(JITCodeLibrary):
    """Code that is there to be linked, not to be run: it has no addresses."""

    def _optimize_final_module(self) -> None:
        """The kernels do that."""

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Null."""
        return 0

    @property
    def codegen(self) -> _Part:
        """Itself: numba asks for it to tell it the environment of a function that can be run."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Nothing: this one cannot."""


@register_pass(mutates_CFG=False, analysis_only=True)
class _OwnLibrary(LoweringPass):
    _name = "library_of_a_part"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """The function will be lowered into a part."""
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        return False


class PartCompiler(CompilerBase):
    """numba's compiler, for functions that are only called by kernels."""

    def define_pipelines(self) -> list[Any]:
        """numba's own passes, and one."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_OwnLibrary, IRLegalization)
        passes.finalize()
        return [passes]
