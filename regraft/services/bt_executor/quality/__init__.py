"""Quality requirements in the tree: QR decorators (ReBeT, section III-B).

Subclass `TaskLevelQR` or `SystemLevelQR` in Python, or use the XML nodes of these names, with ports alone. Where a
requirement holds to a degree, one half is where "satisfied" begins.
"""

from regraft.services.bt_executor.quality.data import Writes
from regraft.services.bt_executor.quality.from_xml import PlainSystemQR, PlainTaskQR
from regraft.services.bt_executor.quality.latest_qualities import LatestQualities
from regraft.services.bt_executor.quality.over_time import Integral, MeanOverTime, Metric, Unknown
from regraft.services.bt_executor.quality.publisher import QualityPublisher
from regraft.services.bt_executor.quality.requirement_node import QualityRequirement
from regraft.services.bt_executor.quality.satisfaction_degree import at_least, at_most, close_to
from regraft.services.bt_executor.quality.system_level import Gathered, SystemLevelQR, combined
from regraft.services.bt_executor.quality.task_level import TaskLevelQR
from regraft.services.bt_executor.quality.verdict import UNKNOWN, QualityTeller, Verdict

__all__ = [
    "UNKNOWN",
    "Gathered",
    "Integral",
    "LatestQualities",
    "MeanOverTime",
    "Metric",
    "PlainSystemQR",
    "PlainTaskQR",
    "QualityPublisher",
    "QualityRequirement",
    "QualityTeller",
    "SystemLevelQR",
    "TaskLevelQR",
    "Unknown",
    "Verdict",
    "Writes",
    "at_least",
    "at_most",
    "close_to",
    "combined",
]
