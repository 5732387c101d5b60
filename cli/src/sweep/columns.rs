//! A table of cases as a Parquet file: numbers as numbers, so that nothing has to be guessed from text.

use super::table::{Row, Table};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};
use std::io::Write;
use std::sync::Arc;

/// One column.
enum Column {
    Texts(Vec<String>),
    /// Nothing where there is no number.
    Numbers(Vec<Option<f64>>),
    Counts(Vec<i32>),
}

impl Table {
    /// As a Parquet file of the columns of [`Table::write_csv`]. What is set is a column of numbers where it is a number in all
    /// cases; where there is no number there is nothing.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn write_parquet(&self, to: impl Write + Send) -> Result<(), ParquetError> {
        let columns = self.columns();
        let fields = columns.iter().map(|(name, column)| Ok(Arc::new(field(name, column)?)));
        let fields = fields.collect::<Result<Vec<TypePtr>, ParquetError>>()?;
        let schema = Type::group_type_builder("cases").with_fields(fields).build()?;
        let mut file = SerializedFileWriter::new(to, Arc::new(schema), Arc::default())?;
        let mut group = file.next_row_group()?;
        columns.iter().try_for_each(|(_, column)| write(column, &mut group))?;
        group.close()?;
        file.close().map(drop)
    }

    fn columns(&self) -> Vec<(String, Column)> {
        let texts = |of: &dyn Fn(&Row) -> String| Column::Texts(self.rows.iter().map(of).collect());
        let mut columns = vec![("case".to_string(), texts(&|row| row.case.clone()))];
        for (k, name) in self.names[..self.set].iter().enumerate() {
            let numbers: Option<Vec<f64>> = self.rows.iter().map(|row| row.set[k].parse().ok()).collect();
            let column = match numbers {
                Some(numbers) => Column::Numbers(numbers.into_iter().map(Some).collect()),
                None => texts(&|row| row.set[k].clone()),
            };
            columns.push((name.clone(), column));
        }
        for (k, name) in self.names[self.set..].iter().enumerate() {
            let number = |row: &Row| Some(row.numbers[k]).filter(|number| !number.is_nan());
            columns.push((name.clone(), Column::Numbers(self.rows.iter().map(number).collect())));
        }
        let failures = |row: &Row| i32::try_from(row.failures).unwrap_or(i32::MAX);
        columns.push(("failures".into(), Column::Counts(self.rows.iter().map(failures).collect())));
        columns
    }
}

fn field(name: &str, column: &Column) -> Result<Type, ParquetError> {
    let (physical, repetition, logical) = match column {
        Column::Texts(_) => (Physical::BYTE_ARRAY, Repetition::REQUIRED, Some(LogicalType::String)),
        Column::Numbers(_) => (Physical::DOUBLE, Repetition::OPTIONAL, None),
        Column::Counts(_) => (Physical::INT32, Repetition::REQUIRED, None),
    };
    let field = Type::primitive_type_builder(name, physical).with_repetition(repetition);
    field.with_logical_type(logical).build()
}

fn write<W: Write + Send>(
    column: &Column,
    group: &mut SerializedRowGroupWriter<'_, W>,
) -> Result<(), ParquetError> {
    let wrong = || ParquetError::General("a column is not of its type".into());
    let mut writer = group.next_column()?.ok_or_else(wrong)?;
    match (column, writer.untyped()) {
        (Column::Texts(texts), ColumnWriter::ByteArrayColumnWriter(writer)) => {
            let texts: Vec<ByteArray> = texts.iter().map(|text| text.as_str().into()).collect();
            writer.write_batch(&texts, None, None)?;
        }
        (Column::Numbers(numbers), ColumnWriter::DoubleColumnWriter(writer)) => {
            // One where there is a number.
            let levels: Vec<i16> = numbers.iter().map(|number| i16::from(number.is_some())).collect();
            let there: Vec<f64> = numbers.iter().copied().flatten().collect();
            writer.write_batch(&there, Some(&levels), None)?;
        }
        (Column::Counts(counts), ColumnWriter::Int32ColumnWriter(writer)) => {
            writer.write_batch(counts, None, None)?;
        }
        _ => return Err(wrong()),
    }
    writer.close()
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    #[test]
    fn what_is_written_is_read_back() {
        let row = |case: &str, set: [&str; 2], numbers: [f64; 2], failures| Row {
            case: case.into(),
            set: set.map(String::from).to_vec(),
            numbers: numbers.to_vec(),
            failures,
        };
        let table = Table {
            names: ["height", "orientation", "peak", "rebound"].map(String::from).to_vec(),
            set: 2,
            rows: vec![
                row("a", ["0.5", "[0, -1, 0]"], [12.5, f64::NAN], 0),
                row("ü, \"b\"", ["1e-3", "[1, 0, 0]"], [-0.1, f64::INFINITY], 2),
            ],
        };
        let mut bytes = Vec::new();
        table.write_parquet(&mut bytes).unwrap();
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        let names: Vec<&str> = rows[0].get_column_iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["case", "height", "orientation", "peak", "rebound", "failures"]);
        for (read, was) in rows.iter().zip(&table.rows) {
            assert_eq!(read.get_string(0).unwrap(), &was.case);
            assert_eq!(read.get_double(1).unwrap(), was.set[0].parse::<f64>().unwrap());
            assert_eq!(read.get_string(2).unwrap(), &was.set[1]);
            assert_eq!(read.get_double(3).unwrap(), was.numbers[0]);
            assert_eq!(read.get_int(5).unwrap(), was.failures as i32);
        }
        // Nothing, not NaN.
        assert!(rows[0].get_double(4).is_err() && rows[1].get_double(4).unwrap() == f64::INFINITY);
        let mut empty = Vec::new();
        Table::default().write_parquet(&mut empty).unwrap();
        assert_eq!(
            SerializedFileReader::new(bytes::Bytes::from(empty)).unwrap().get_row_iter(None).unwrap().count(),
            0
        );
    }
}
