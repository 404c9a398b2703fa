"""What the numbers of a trial say: tables and sentences, each with its unit, for every form of a report."""
