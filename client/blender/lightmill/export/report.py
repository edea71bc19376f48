"""What could not be exported as it is, said once a kind."""
from dataclasses import dataclass

MOST_MESSAGES = 1000  # of all kinds
MOST_TEXT = 500  # characters of a text or a name


@dataclass
class Message:
    """One kind of thing that is left out or drawn otherwise. `object` is the first that has it."""

    kind: str
    object: str
    text: str
    count: int = 1  # how often it was met

    def __str__(self):
        more = f" (and {self.count - 1} more)" if self.count > 1 else ""
        return f"{self.object}: {self.text}{more}" if self.object else f"{self.text}{more}"


class Report:
    """Messages by kind, in the order in which they were met first."""

    def __init__(self):
        self._messages = {}

    def warn(self, kind, object_name, text):
        """Notes `text` unless something of this kind has been said."""
        said = self._messages.get(kind)
        if said:
            said.count += 1
        elif len(self._messages) < MOST_MESSAGES:
            self._messages[kind] = Message(kind, one_line(object_name), one_line(text))

    @property
    def messages(self):
        return list(self._messages.values())


def one_line(text):
    """Without line breaks and what a terminal would obey, and not too long."""
    plain = "".join(c if c.isprintable() else " " for c in str(text)[:MOST_TEXT])
    return plain.encode("utf-8", "replace").decode("utf-8")
