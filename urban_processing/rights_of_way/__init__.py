"""Rights-of-way: the land that streets take, and what they leave of each parcel."""

from urban_processing.rights_of_way.centrelines import rights_of_way_of_lines
from urban_processing.rights_of_way.lay_out import lay_out_rights_of_way
from urban_processing.rights_of_way.partition import RightsOfWay

__all__ = ["RightsOfWay", "lay_out_rights_of_way", "rights_of_way_of_lines"]
