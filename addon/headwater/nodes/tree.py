# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks Blender node trees: follows links through groups, reroutes and muted nodes, and evaluates sockets.

Nodes are evaluated by generators that yield the sockets they need and are sent expressions, so that a deep tree needs
no recursion; a link that leads back to itself gives the socket's default value.
"""

from dataclasses import dataclass

from headwater.materials import Expr, Graph, Unsupported
from headwater.materials import opcodes as op

GENERATED = ".generated"  # attribute of meshes: texture space, before anything deformed them
MAX_LINKS = 10000  # hops followed from one socket; a longer chain is taken as unlinked
_SCALARS = {"VALUE", "INT", "BOOLEAN"}


class Context:
    """One use of a node group: the node that holds it, in the context around it. The root has none."""

    def __init__(self, parent: "Context | None" = None, node=None):
        self.parent, self.node = parent, node
        self._inner: dict[int, Context] = {}
        self._links: dict[int, dict] = parent._links if parent is not None else {}

    def link_into(self, socket):
        """The link in use into a socket, or None. All links of a tree are listed once: asking a socket for its own
        walks through all of them."""
        if not socket.is_linked:
            return None
        tree = socket.id_data
        key = tree.as_pointer()
        if key not in self._links:
            valid = [k for k in tree.links if not k.is_muted and k.is_valid]
            self._links[key] = {k.to_socket.as_pointer(): k for k in reversed(valid)}
        return self._links[key].get(socket.as_pointer())

    def inside(self, node) -> "Context":
        return self._inner.setdefault(node.as_pointer(), Context(self, node))


@dataclass(frozen=True, eq=False)
class Source:
    """Where a socket's value comes from: a node's output, or (node None) the default of `socket`."""

    context: Context
    node: object
    socket: object
    types: tuple  # socket types passed through, from the source to the asking socket


@dataclass(frozen=True, eq=False)
class Ask:
    """A request for the value of an input socket. `default`: for a socket without a link whose value is geometry;
    an expression, or a function that makes one."""

    context: Context
    socket: object
    shift: int
    width: Expr | None
    default: object = None


def _find(sockets, identifier):
    for socket in sockets:
        if socket.identifier == identifier:
            return socket
    return None


def _group_output(tree):
    found = None
    for node in tree.nodes:
        if node.bl_idname == "NodeGroupOutput" and (found is None or node.is_active_output):
            found = node
    return found


def resolve(socket, context: Context) -> Source:
    """Follows the link into `socket` to the node that makes its value."""
    types = [socket.type]
    for _ in range(MAX_LINKS):
        link = context.link_into(socket)
        if link is None:
            return Source(context, None, socket, tuple(reversed(types)))
        output, node = link.from_socket, link.from_node
        types.append(output.type)
        if node.bl_idname == "NodeReroute":
            following = node.inputs[0]
        elif node.mute:
            following = next((inner.from_socket for inner in node.internal_links if inner.to_socket == output), None)
        elif node.bl_idname == "NodeGroupInput":
            following = _find(context.node.inputs, output.identifier) if context.node is not None else None
            context = context.parent if context.parent is not None else context
        elif node.bl_idname in ("ShaderNodeGroup", "ShaderNodeCustomGroup") and node.node_tree is not None:
            context = context.inside(node)
            inner = _group_output(node.node_tree)
            following = _find(inner.inputs, output.identifier) if inner is not None else None
        else:
            return Source(context, node, output, tuple(reversed(types)))
        if following is None:
            return Source(context, None, socket, tuple(reversed(types[:-1])))
        socket = following
        types.append(socket.type)
    return Source(context, None, socket, tuple(reversed(types)))


def convert(g: Graph, value: Expr, source: str, target: str) -> Expr:
    """Blender's implicit conversion between socket types."""
    if target in _SCALARS and source == "RGBA":
        value = g.luminance(value)
    elif target in _SCALARS and source == "VECTOR":
        value = g.average(value)
    if target == "INT" and source not in ("INT", "BOOLEAN"):
        down = g.floor(value)
        value = g.select(g.less(value, g.zero), down, g.negate(g.floor(g.negate(value))))
    elif target == "BOOLEAN" and source != "BOOLEAN":
        value = g.less(g.zero, value)
    return value


class Call:
    """A node while one of its outputs is evaluated: what handlers see."""

    def __init__(self, compiler: "TreeCompiler", context: Context, node, output, shift: int, width):
        self.compiler, self.graph = compiler, compiler.graph
        self.context, self.node, self.output = context, node, output
        self.shift, self.width = shift, width

    def __call__(self, name, default=None) -> Ask:
        """An input by name, identifier or index; the first one available of that name."""
        return Ask(self.context, self.socket(name), self.shift, self.width, default)

    def socket(self, name):
        inputs = self.node.inputs
        if isinstance(name, int):
            return inputs[name]
        named = [s for s in inputs if s.identifier == name] or [s for s in inputs if s.name == name]
        shown = [s for s in named if not s.is_unavailable]
        if not named:
            raise KeyError(f"it has no input '{name}'")
        return (shown or named)[0]

    def has(self, name: str) -> bool:
        return any(s.name == name or s.identifier == name for s in self.node.inputs)

    def shifted(self, name, shift: int, width: Expr) -> Ask:
        return Ask(self.context, self.socket(name), shift, width)

    def input(self, kind: int) -> Expr:
        """op.INPUT_* at the (shifted) point."""
        return self.graph.input(kind, self.shift, self.width)

    def attribute(self, name: str, what: int = op.ATTRIBUTE_VALUE) -> Expr:
        self.compiler.attributes.add(name)
        return self.graph.attribute(name, what, self.shift, self.width)

    def generated(self) -> Expr:
        """Generated coordinates at the (shifted) point; the direction in a background."""
        return self.attribute(GENERATED) if self.compiler.on_surface else self.input(op.INPUT_GENERATED)

    def unsupported(self, reason: str) -> None:
        self.compiler.unsupported(self.node, reason)

    @property
    def wanted(self) -> str:
        """Name of the output asked for."""
        return self.output.name


class TreeCompiler:
    """Evaluates sockets of one node tree into expressions of one graph."""

    def __init__(self, name: str, handlers: dict, on_surface: bool = False):
        self.name, self.on_surface = name, on_surface
        self.graph = Graph()
        self.normal = self.graph.normal  # what unlinked Normal sockets read
        self.root = Context()
        self.images: list = []
        self.attributes: set[str] = set()
        self.problems: list[Unsupported] = []
        self._handlers = handlers
        self._values: dict[tuple, Expr] = {}
        self._image_index: dict[tuple, int] = {}

    def unsupported(self, node, reason: str) -> None:
        """Lists something once for each node and reason."""
        found = Unsupported(getattr(node, "bl_label", "") or "Node", getattr(node, "name", ""), self.name, reason)
        if found not in self.problems:
            self.problems.append(found)

    def image_index(self, key: tuple, request) -> int:
        index = self._image_index.get(key)
        if index is None:
            index = self._image_index[key] = len(self.images)
            self.images.append(request)
        return index

    def default(self, socket) -> Expr:
        """A socket's own value."""
        value = getattr(socket, "default_value", None)
        g = self.graph
        if value is None or isinstance(value, str):
            return g.zero
        if isinstance(value, (int, float, bool)):
            return g.const(float(value))
        parts = [float(x) for x in value][:3]
        return g.const(*(parts + [0.0] * (3 - len(parts))))

    def value(self, socket, context: Context | None = None, default=None) -> Expr:
        """The value of an input socket."""
        return self._run(Ask(context or self.root, socket, 0, None, default))

    def value_shifted(self, socket, shift: int, width: Expr) -> Expr:
        return self._run(Ask(self.root, socket, shift, width))

    def run(self, generator) -> Expr:
        """Runs a generator that yields Asks, to its return value."""
        return self._drive([(generator, None, None)], set(), None)

    def _run(self, ask: Ask) -> Expr:
        stack: list = []
        running: set[tuple] = set()
        return self._drive(stack, running, self._begin(ask, stack, running))

    def _drive(self, stack: list, running: set, answer):
        """Runs the generators on the stack, which `answer` goes to first, to the last one's return value."""
        while stack:
            current, key, types = stack[-1]
            try:
                ask = current.send(answer)
            except StopIteration as finished:
                stack.pop()
                answer = finished.value
                if key is not None:
                    running.discard(key)
                    self._values[key] = answer
                    answer = self._converted(answer, types)
                continue
            answer = self._begin(ask, stack, running)
        return answer

    def _begin(self, ask: Ask, stack: list, running: set):
        """The value asked for if it is at hand; else pushes the node's generator and gives None to start it."""
        source = resolve(ask.socket, ask.context)
        if source.node is None:
            unlinked = source.socket is ask.socket or source.socket == ask.socket
            if ask.default is not None and (unlinked or source.socket.hide_value):
                return ask.default() if callable(ask.default) else ask.default
            return self._converted(self.default(source.socket), source.types)
        key = (source.context, source.node.as_pointer(), source.socket.identifier, ask.shift, ask.width)
        if key in self._values:
            return self._converted(self._values[key], source.types)
        if key in running:
            self.unsupported(source.node, "its links form a loop; a default value is used")
            return self._converted(self.default(source.socket), source.types)
        running.add(key)
        call = Call(self, source.context, source.node, source.socket, ask.shift, ask.width)
        stack.append((self._node(call), key, source.types))
        return None

    def _node(self, call: Call):
        handler = self._handlers.get(call.node.bl_idname)
        if handler is None:
            call.unsupported("this node is not supported; its output has a default value")
            return self.default(call.output)
            yield
        try:
            result = handler(call)
            if hasattr(result, "send"):
                result = yield from result
        except (KeyError, AttributeError, IndexError, ValueError) as error:
            # A newer Blender's setting, or a node from a damaged file.
            call.unsupported(f"a setting is not supported ({error}); its output has a default value")
            result = self.default(call.output)
        return result

    def _converted(self, value: Expr, types: tuple) -> Expr:
        for source, target in zip(types, types[1:], strict=False):
            value = convert(self.graph, value, source, target)
        return value
