"""No contact: bodies pass through each other. What any rule is measured against."""

from dataclasses import dataclass

from mpmbench.core.contact import ContactRule
from mpmbench.core.registry import register


@register("contact", "none")
@dataclass(frozen=True)
class NoContact(ContactRule):
    """Own nodes only: bodies pass through each other."""
